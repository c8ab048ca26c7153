// Overlays as videos, read back by ffmpeg.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "services/results/export/export_overlays.h"
#include "tests/services/results/export/filmed_result.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

std::string OutputOfCommand(const std::string& command) {
  FILE* program = popen((command + " 2>&1").c_str(), "r");
  std::string text;
  for (int c = fgetc(program); c != EOF; c = fgetc(program)) text += static_cast<char>(c);
  EXPECT_EQ(pclose(program), 0) << text;
  return text;
}

class OverlayVideoTest : public testing::Test {
 protected:
  OverlayVideoTest() {
    request_.result = filmed_.request.result, request_.out = filmed_.folder / "out";
    request_.recording = filmed_.recording;
    request_.recording.cameras = {"c2"};
    request_.kind = OverlayKind::kNone, request_.format = PictureFormat::kMp4, request_.fps = 12.5;
  }

  // Each frame as bytes of RGB.
  std::vector<std::string> FramesOf(const std::string& name) const {
    OutputOfCommand("ffmpeg -v error -y -i '" + request_.out + "/" + name + "' -f rawvideo -pix_fmt rgb24 '" +
                    filmed_.folder / "raw" + "'");
    const std::string raw = ReadBytes(filmed_.folder / "raw");
    constexpr size_t kBytes = size_t{3} * FilmedResult::kWidth_px * FilmedResult::kHeight_px;
    EXPECT_EQ(raw.size() % kBytes, 0u);
    std::vector<std::string> frames;
    for (size_t at = 0; at + kBytes <= raw.size(); at += kBytes) frames.push_back(raw.substr(at, kBytes));
    return frames;
  }
  // "seen" where the middle has the colour of the pictures, "black", or another.
  std::vector<std::string> Shown(const std::string& name, int x = 80, int y = 50) const {
    std::vector<std::string> shown;
    for (const std::string& frame : FramesOf(name)) {
      const size_t at = 3 * static_cast<size_t>(y * FilmedResult::kWidth_px + x);
      int off = 0, sum = 0;
      for (size_t c = 0; c < 3; ++c) {
        const int value = static_cast<uint8_t>(frame[at + c]);
        off = std::max(off, std::abs(value - FilmedResult::kColor[c]));
        sum += value;
      }
      shown.emplace_back(off <= 6 ? "seen" : sum <= 12 ? "black" : "other");
    }
    return shown;
  }
  void Fail(int frame) {
    v1::FrameReport report;
    report.set_state(v1::FRAME_STATE_FAILED), report.set_reason("too dark");
    filmed_.WriteReport(frame, report);
  }

  FilmedResult filmed_;
  OverlayRequest request_;
};

TEST_F(OverlayVideoTest, ACameraHasAVideoOfItsFramesAtTheirRate) {
  std::vector<std::string> steps;
  const auto outcome = ExportOverlays(request_,
                                      [&](ExportStep step, size_t done, size_t all) {
                                        if (step == ExportStep::kWrite)
                                          steps.push_back(absl::StrCat(done, "/", all));
                                      },
                                      {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_THAT(outcome->manifest.files(), ElementsAre("c2.mp4"));
  EXPECT_THAT(outcome->warnings, testing::IsEmpty());
  EXPECT_THAT(steps, ElementsAre("1/3", "2/3", "3/3"));
  EXPECT_FALSE(std::filesystem::exists(request_.out + "/c2"));
  EXPECT_EQ(
      OutputOfCommand("ffprobe -v error -show_entries stream=codec_name,width,height,pix_fmt,color_space,"
                      "color_primaries,color_transfer,color_range,r_frame_rate,nb_frames -of compact=p=0 '" +
                      request_.out + "/c2.mp4'"),
      R"(codec_name=h264|width=160|height=100|pix_fmt=yuv420p|color_range=tv|color_space=bt709|color_transfer=bt709|color_primaries=bt709|r_frame_rate=25/2|nb_frames=3
)");
  EXPECT_THAT(Shown("c2.mp4"), ElementsAre("seen", "seen", "seen"));
}

TEST_F(OverlayVideoTest, TheMeshLiesOverThePicture) {
  request_.kind = OverlayKind::kWireframe, request_.format = PictureFormat::kMkv;
  ASSERT_TRUE(ExportOverlays(request_, nullptr, {}).ok());
  EXPECT_THAT(Shown("c2.mkv", 30, 50), ElementsAre("other", testing::_, testing::_))
      << "the edge of the square";
  EXPECT_THAT(Shown("c2.mkv", 10, 50), ElementsAre("seen", "seen", "seen")) << "beside it";
}

TEST_F(OverlayVideoTest, FramesWithoutAMeshShowTheirPictureAndGapsInTimeLast) {
  Fail(1);
  std::filesystem::remove(filmed_.Picture(0, "c2"));
  request_.kind = OverlayKind::kState;
  const auto outcome = ExportOverlays(request_, nullptr, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  ASSERT_EQ(outcome->warnings.size(), 1u);
  EXPECT_THAT(outcome->warnings[0], testing::StartsWith("Frame 0000, camera c2: "));
  EXPECT_THAT(Shown("c2.mp4", 60, 35), ElementsAre("black", "seen", "other"));
}

TEST_F(OverlayVideoTest, AFrameThatTheRecordingLacksKeepsWhatWasShown) {
  Fail(1);
  std::filesystem::remove_all(filmed_.folder / "dump/0001");
  const auto outcome = ExportOverlays(request_, nullptr, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_THAT(outcome->warnings, ElementsAre("Frame 0001, camera c2: is not in the recording"));
  EXPECT_THAT(Shown("c2.mp4"), ElementsAre("seen", "seen", "seen"));
}

TEST_F(OverlayVideoTest, AStopKeepsTheVideosThatAreThere) {
  request_.recording.cameras = {"c1", "c2"};
  std::stop_source stop;
  size_t steps = 0;
  const auto stopped = ExportOverlays(
      request_,
      [&](ExportStep step, size_t, size_t) {
        if (step == ExportStep::kWrite && ++steps == 4) stop.request_stop();
      },
      stop.get_token());
  EXPECT_EQ(stopped.status(),
            absl::CancelledError("stopped after 1 of 2 videos; the same command goes on from there"));
  EXPECT_TRUE(std::filesystem::exists(request_.out + "/c1.mp4"));
  EXPECT_FALSE(std::filesystem::exists(request_.out + "/c2.mp4"));
  std::vector<std::string> rest;
  const auto outcome = ExportOverlays(request_,
                                      [&](ExportStep step, size_t done, size_t all) {
                                        if (step == ExportStep::kWrite)
                                          rest.push_back(absl::StrCat(done, "/", all));
                                      },
                                      {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_THAT(rest, ElementsAre("4/6", "5/6", "6/6"));
  EXPECT_THAT(Shown("c2.mp4"), ElementsAre("seen", "seen", "seen"));
}

TEST_F(OverlayVideoTest, UndistortedVideosAreOfPinholeCameras) {
  filmed_.rig.cameras[1].distortion[0] = -0.4;
  filmed_.rig.cameras[1].fx_px = filmed_.rig.cameras[1].fy_px = 100;
  ASSERT_TRUE(WriteRig(filmed_.recording.rig, filmed_.rig).ok());
  request_.undistort = true;
  const auto outcome = ExportOverlays(request_, nullptr, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(outcome->manifest.overlay(), "none, undistorted");
  EXPECT_THAT(Shown("c2.mp4"), ElementsAre("seen", "seen", "seen"));
  EXPECT_EQ(ReadRig(request_.out + "/rig.json")->cameras[0].distortion, (std::array<double, 8>{}));
}

}  // namespace
}  // namespace weft
