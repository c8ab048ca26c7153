// Runs in a guest with the kernel's virtual video driver (guest.py). Every instruction there is emulated.
//   v4l2_guest check                                             GoogleTest on /dev/video0
//   v4l2_guest record SESSION TAKE SECONDS [AT_S DEVICE CONTROL]...
// records for so long after the first frame set, and sets controls meanwhile.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "capture/camera/v4l2_camera.h"
#include "services/studio/recording/session_file.h"
#include "services/studio/recording/take_file.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kDevice = "/dev/video0";
// A picture that is the same in every frame.
const std::vector<std::string> kStill = {"Test Pattern=100% Colorbar", "OSD Text Mode=None",
                                         "Brightness=128"};

V4l2CameraOptions Camera(const std::string& format, V4l2Memory memory = V4l2Memory::kMmap) {
  V4l2CameraOptions options;
  options.id = "usb";
  options.device = kDevice;
  options.format = format;
  options.width_px = 320;
  options.height_px = 180;
  options.fps = 10;
  options.controls = kStill;
  options.memory = memory;
  return options;
}

void SetControl(const std::string& device, const std::string& control) {
  absl::StatusOr<V4l2Device> opened = V4l2Device::Open("other", device);
  const absl::Status status = opened.ok() ? opened->SetControl(control) : opened.status();
  if (!status.ok()) std::printf("%s: %s\n", control.c_str(), std::string(status.message()).c_str());
}

// What the camera delivers until there are so many frames.
std::vector<CameraDelivery> Deliveries(CameraSource& camera, size_t frames) {
  std::vector<CameraDelivery> found;
  for (int tries = 0; frames > 0 && tries < 400; ++tries) {
    absl::StatusOr<CameraDelivery> delivery = camera.Next(std::chrono::milliseconds(100));
    if (!delivery.ok()) continue;
    frames -= delivery->kind == CameraDelivery::Kind::kFrame ? 1 : 0;
    found.push_back(*std::move(delivery));
  }
  EXPECT_EQ(frames, 0u);
  if (found.empty()) found.emplace_back();
  return found;
}

RawFrame StillOf(const V4l2CameraOptions& options) {
  auto camera = OpenV4l2Camera(options);
  EXPECT_TRUE(camera.ok()) << camera.status();
  if (!camera.ok()) return {};
  const absl::Status started = (*camera)->Start();
  EXPECT_TRUE(started.ok()) << started;
  RawFrame frame = Deliveries(**camera, 2).back().frame;
  (*camera)->Stop();
  return frame;
}

std::string FaultOf(const V4l2CameraOptions& options) {
  const absl::Status status = OpenV4l2Camera(options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

TEST(V4l2Device, TellsFormatsAndControls) {
  const auto device = V4l2Device::Open("usb", kDevice);
  ASSERT_TRUE(device.ok()) << device.status();
  EXPECT_EQ(device->identity().driver, "vivid");
  EXPECT_THAT(device->Formats(), AllOf(Contains(StartsWith("YUV422_8 (YUYV) 320x180, 640x360")),
                                       Contains(StartsWith("BayerRG12 (RG12)")), Contains("[NV12]")));
  EXPECT_THAT(device->Controls(),
              AllOf(Contains(HasSubstr("(0 to 255)")), Contains(HasSubstr("100% Colorbar, "))));
  EXPECT_EQ(FindV4l2Cameras().size(), 2u);
  EXPECT_TRUE(V4l2Device::Open("usb", "platform:vivid-001").ok());
  EXPECT_EQ(V4l2Device::Open("usb", "platform:vivid-007").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(V4l2Device::Open("usb", "/dev/null").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(V4l2Device, RefusalsNameWhatIsAllowed) {
  V4l2CameraOptions options = Camera("H264");
  EXPECT_THAT(FaultOf(options), AllOf(HasSubstr("no images of format H264"), HasSubstr("Mono8 (GREY)")));
  options = Camera("YUYV");
  options.width_px = 321;
  EXPECT_THAT(FaultOf(options), AllOf(HasSubstr("no images of 321x180"), HasSubstr("320x180, 640x360")));
  options = Camera("YUYV");
  options.fps = 7;
  EXPECT_THAT(FaultOf(options), AllOf(HasSubstr("not film at 7"), HasSubstr("10, 12.5, 15, 25")));
  options = Camera("YUYV");
  options.controls = {"Colour=7"};
  EXPECT_THAT(FaultOf(options), AllOf(HasSubstr("no control Colour"), HasSubstr("Brightness")));
  options.controls = {"brightness=300"};
  EXPECT_THAT(FaultOf(options), AllOf(HasSubstr("does not take \"300\""), HasSubstr("0 to 255")));
  options.controls = {"Test Pattern=Kitten"};
  EXPECT_THAT(FaultOf(options), HasSubstr("75% Colorbar, 100% Colorbar"));
}

TEST(V4l2Camera, BuffersOfBothKindsHoldTheSameImage) {
  for (const char* format : {"YUV422_8", "BayerRG8"}) {
    const RawFrame mapped = StillOf(Camera(format)), own = StillOf(Camera(format, V4l2Memory::kUser));
    ASSERT_TRUE(mapped.bytes && own.bytes && mapped.bytes->size() == own.bytes->size());
    EXPECT_TRUE(std::equal(own.bytes->data(), own.bytes->data() + own.bytes->size(), mapped.bytes->data()));
  }
}

// The driver's own RGB image says what the others must show.
TEST(V4l2Camera, FormatsShowTheSamePicture) {
  const auto rgb = ToFrame(StillOf(Camera("RGB8")));
  ASSERT_TRUE(rgb.ok()) << rgb.status();
  const auto expect_near = [&](const char* format, auto channel_of, int tolerance) {
    const auto frame = ToFrame(StillOf(Camera(format)));
    ASSERT_TRUE(frame.ok()) << frame.status();
    const size_t channels = frame->pixels->size() / (320 * 180);
    int worst = 0;
    for (size_t y = 0; y < 180; ++y)
      for (size_t x = 4; x < 316; ++x) {
        if (x % 40 < 4 || x % 40 > 36) continue;  // chroma is shared across the edges of the bars
        for (size_t c = 0; c < channels; ++c) {
          const int expected = (*rgb->pixels)[3 * (y * 320 + x) + (channels == 3 ? c : channel_of(x, y))];
          worst = std::max(worst, std::abs(expected - (*frame->pixels)[channels * (y * 320 + x) + c]));
        }
      }
    EXPECT_LE(worst, tolerance) << format;
  };
  const auto none = [](size_t, size_t) { return size_t{0}; };
  const auto rggb = [](size_t x, size_t y) { return x % 2 + y % 2; };
  expect_near("BGR8", none, 0);
  expect_near("YUV422_8", none, 6);
  expect_near("YUV422_8_UYVY", none, 6);
  for (const char* format : {"BayerRG8", "BayerRG10", "BayerRG12"}) expect_near(format, rggb, 1);
}

// Goes on until a delivery says so; a slow guest may lose frames on its own besides.
bool Says(CameraSource& camera, CameraDelivery::Kind kind, const std::string& words) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (std::chrono::steady_clock::now() < end) {
    const absl::StatusOr<CameraDelivery> delivery = camera.Next(std::chrono::milliseconds(100));
    if (delivery.ok() && delivery->kind == kind && delivery->cause.find(words) != std::string::npos)
      return true;
  }
  return false;
}

TEST(V4l2Camera, EveryLossHasItsCause) {
  using Kind = CameraDelivery::Kind;
  auto camera = OpenV4l2Camera(Camera("YUYV"));
  ASSERT_TRUE(camera.ok()) << camera.status();
  ASSERT_TRUE((*camera)->Start().ok());
  EXPECT_EQ((*camera)->settings()["PixelFormat"], "YUV422_8");
  EXPECT_EQ((*camera)->settings()["Brightness"], "128");
  Deliveries(**camera, 1);
  SetControl(kDevice, "Brightness=100");
  EXPECT_TRUE(Says(**camera, Kind::kNote, "Brightness to 100"));
  SetControl(kDevice, "Inject V4L2_BUF_FLAG_ERROR");
  EXPECT_TRUE(Says(**camera, Kind::kLostFrame, "torn: the driver marks the image as damaged"));
  SetControl(kDevice, "Percentage of Dropped Buffers=50");
  EXPECT_TRUE(Says(**camera, Kind::kLostFrame, "did not deliver it: dropped by the camera"));
  SetControl(kDevice, "Percentage of Dropped Buffers=0");
  std::this_thread::sleep_for(std::chrono::seconds(2));  // 8 buffers are full after 0.8 s
  EXPECT_TRUE(Says(**camera, Kind::kLostFrame, "all 8 buffers were full, since the host was busy for"));
  SetControl(kDevice, "Inject Fatal Streaming Error");
  EXPECT_TRUE(Says(**camera, Kind::kDisconnected, "error of the stream"));
  EXPECT_TRUE(Says(**camera, Kind::kReconnected, "same settings"));
  Deliveries(**camera, 2);
  SetControl(kDevice, "Disconnect");
  EXPECT_TRUE(Says(**camera, Kind::kDisconnected, "the device is gone"));
  EXPECT_TRUE(Says(**camera, Kind::kReconnected, "same settings"));
  Deliveries(**camera, 2);
  EXPECT_EQ((*camera)->counters().disconnections, 2u);
}

int Record(int argc, char** argv) {
  const auto session = ReadSession(argv[2]);
  if (!session.ok()) return std::puts(session.status().ToString().c_str()), 2;
  auto options = RecordingOptionsOf(*session);
  const auto cameras = OpenCameras(*session);
  if (!options.ok() || !cameras.ok())
    return std::puts((options.ok() ? cameras.status() : options.status()).ToString().c_str()), 2;
  std::atomic<bool> stop = false;
  std::optional<double> begin_s;
  int next = 5;
  const auto at_its_time = [&](const LiveRecordingState& state) {
    if (!begin_s && state.recorder.sets_recorded > 0) begin_s = state.elapsed_s;
    const double elapsed_s = begin_s ? state.elapsed_s - *begin_s : 0;
    for (; next + 2 < argc && begin_s && elapsed_s >= std::atof(argv[next]); next += 3)
      SetControl(argv[next + 1], argv[next + 2]);
    stop = elapsed_s >= std::atof(argv[4]) || (!begin_s && state.elapsed_s > 60);
  };
  const auto take = RecordLive(argv[3], *cameras, *options, stop, at_its_time);
  if (!take.ok()) std::puts(take.status().ToString().c_str());
  return take.ok() ? 0 : 1;
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  if (argc > 4 && std::string(argv[1]) == "record") return weft::Record(argc, argv);
  testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}
