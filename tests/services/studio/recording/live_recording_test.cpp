#include "services/studio/recording/live_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <thread>

#include "base/host_clock.h"
#include "services/studio/recording/clock_log.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/recording/take_recovery.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;

// A machine with other things to do starts threads late, but not by minutes.
constexpr std::chrono::seconds kRecordingTimeout{60};
constexpr int64_t kPeriod_ns = 100'000'000;

// Those who come wait until all are there.
class MeetingPoint {
 public:
  explicit MeetingPoint(size_t expected) : expected_(expected) {}
  void Come() {
    std::unique_lock lock(mutex_);
    ++here_;
    changed_.notify_all();
    const auto is_over = [&] { return here_ >= expected_ || has_waited_in_vain_; };
    if (!changed_.wait_for(lock, kRecordingTimeout, is_over)) has_waited_in_vain_ = true;
  }
  bool has_met() {
    const std::lock_guard lock(mutex_);
    return here_ == expected_ && !has_waited_in_vain_;
  }

 private:
  const size_t expected_;
  std::mutex mutex_;
  std::condition_variable changed_;
  size_t here_ = 0;
  bool has_waited_in_vain_ = false;
};

// Delivers some frames, then is gone for good. It stops once every camera was told to.
class VanishingCamera : public CameraSource {
 public:
  VanishingCamera(std::string id, int frames, int64_t first_frame_ns, MeetingPoint& stops)
      : id_(std::move(id)), frames_(frames), first_frame_ns_(first_frame_ns), stops_(stops) {}

  const std::string& camera_id() const override { return id_; }
  std::map<std::string, std::string> settings() const override { return {}; }
  absl::Status Start() override { return absl::OkStatus(); }
  absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds timeout) override {
    CameraDelivery delivery;
    if (delivered_ < frames_) {
      delivery.frame = Frame(delivered_++);
      return delivery;
    }
    if (!is_gone_) {
      is_gone_ = true;
      delivery.kind = CameraDelivery::Kind::kDisconnected;
      delivery.cause = "pulled out";
      return delivery;
    }
    std::this_thread::sleep_for(timeout);
    return absl::DeadlineExceededError("the camera is disconnected");
  }
  void Stop() override { stops_.Come(); }
  CameraCounters counters() const override { return {}; }

 private:
  RawFrame Frame(int number) const {
    auto bytes = std::make_shared<AlignedBuffer>(64);
    std::fill_n(bytes->data(), bytes->size(), uint8_t{7});
    RawFrame frame;
    frame.camera_id = id_;
    frame.width_px = frame.height_px = 8;
    frame.format = RawFormat::kMono8;
    frame.bytes = std::move(bytes);
    frame.device_time_ns = frame.host_time_ns = first_frame_ns_ + number * kPeriod_ns;
    frame.device_frame_id = static_cast<uint64_t>(number) + 1;
    return frame;
  }

  const std::string id_;
  const int frames_;
  const int64_t first_frame_ns_;
  MeetingPoint& stops_;
  int delivered_ = 0;
  bool is_gone_ = false;
};

// One camera for each number of frames.
std::vector<std::unique_ptr<CameraSource>> Cameras(const std::vector<int>& frames, MeetingPoint& stops) {
  const int64_t now_ns = HostTime_ns();
  std::vector<std::unique_ptr<CameraSource>> cameras;
  for (const int count : frames)
    cameras.push_back(
        std::make_unique<VanishingCamera>("cam" + std::to_string(cameras.size()), count, now_ns, stops));
  return cameras;
}

LiveRecordingOptions Options() {
  LiveRecordingOptions options;
  options.sets.period_ns = kPeriod_ns;
  options.recorder.low_disk_bytes = 0;
  options.recorder.take.stream.preallocate_bytes = 1 << 20;
  options.seconds = 0.5;
  return options;
}

// A request to a camera that is gone takes 3 s to fail: eight of them one after the other would be 24 s late.
TEST(RecordLive, TakesLeaveOfAllCamerasAtTheSameTime) {
  const TempFolder temp;
  MeetingPoint stops(8);
  const std::atomic<bool> stop = false;
  const auto take = RecordLive(temp / "take", Cameras(std::vector<int>(8, 1), stops), Options(), stop);
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_TRUE(stops.has_met());
  EXPECT_EQ(take->sets_recorded(), 1u);
  EXPECT_GE(take->sets_dropped(), 3u);
}

// However patient the session is with the living: a wait of an hour is no slow machine.
TEST(RecordLive, WaitsForNoFrameOfACameraThatIsGone) {
  const TempFolder temp;
  MeetingPoint stops(2);
  LiveRecordingOptions options = Options();
  options.sets.max_wait_ns = int64_t{3600} * 1'000'000'000;
  const std::atomic<bool> stop = false;
  const auto start = Clock::now();
  const auto take = RecordLive(temp / "take", Cameras({3, 1}, stops), options, stop);
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_LT(Clock::now() - start, std::chrono::minutes(30));
  EXPECT_EQ(take->sets_recorded(), 3u);
  EXPECT_EQ(take->frames_missing(), 2u);
}

TEST(RecordLive, SaysBeforeACameraStartsThatTheDiskIsTooFull) {
  const TempFolder temp;
  MeetingPoint stops(1);
  LiveRecordingOptions options = Options();
  options.recorder.low_disk_bytes = uint64_t{1} << 62;
  const std::atomic<bool> stop = false;
  const absl::Status status = RecordLive(temp / "take", Cameras({3}, stops), options, stop).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("low_disk_gib"));
  EXPECT_FALSE(std::filesystem::exists(temp / "take"));
}

// The log of the clocks is a part of the take: what is lost of it is found, and the rest is kept.
TEST(RecordLive, ClocksOfATakeAreVerifiedAndRecovered) {
  using ::testing::HasSubstr;
  const TempFolder temp;
  const std::string take = temp / "take", log = take + "/clocks.csv";
  MeetingPoint stops(1);
  const std::atomic<bool> stop = false;
  ASSERT_TRUE(RecordLive(take, Cameras({3}, stops), Options(), stop).ok());
  const auto problems = [&take] {
    const auto report = VerifyRecordedTake(take);
    std::string all;
    if (report.ok())
      for (const std::string& problem : report->problems()) all += problem + "\n";
    return report.ok() ? all : std::string(report.status().message());
  };
  EXPECT_EQ(problems(), "");
  const auto said = [&take] {  // by `weft take info`, which reads no frames
    const v1::Verdict verdict = DescribeTake(take)->verdict();
    std::string all = verdict.reason() + "\n";
    for (const v1::VerdictFinding& other : verdict.others()) all += other.reason() + "\n";
    return all;
  };
  EXPECT_THAT(said(), ::testing::Not(HasSubstr("clocks.csv")));
  const std::string cut = ReadBytes(log).substr(0, ReadBytes(log).find('\n') + 1);
  WriteBytes(log, cut);
  EXPECT_THAT(problems(), HasSubstr("clocks.csv: has no end"));
  const std::string readings =
      ClockLogText({{"cam0", {1000, -5, 3, "", {}}}, {"cam0", {2000, -6, 3, "", {}}}});
  WriteBytes(log, readings);
  EXPECT_THAT(problems(), HasSubstr("clocks.csv: is not the one that was written with this take"));
  EXPECT_THAT(said(), HasSubstr("clocks.csv: is not the one"));
  ASSERT_TRUE(RecoverRecordedTake(take, {.force = true}).ok());
  EXPECT_EQ(problems(), "");
  std::filesystem::remove(log);
  EXPECT_EQ(problems(), "clocks.csv: is missing\n");
  EXPECT_THAT(said(), HasSubstr("clocks.csv: is missing"));
  ASSERT_TRUE(RecoverRecordedTake(take, {.force = true}).ok());
  EXPECT_EQ(problems(), "");
  // From here on as a take of an earlier version, which does not name its log.
  v1::Take described = *ReadTakeFile(take);
  described.clear_clocks_checksum();
  ASSERT_TRUE(WriteTakeFile(take, described).ok());
  WriteBytes(log, readings);
  EXPECT_EQ(problems(), "");
  std::string damaged = readings;
  damaged[damaged.find("2000")] = '9';
  WriteBytes(log, damaged);
  EXPECT_THAT(problems(), HasSubstr("clocks.csv: line 3 is not as it was written, 1 in all"));
  EXPECT_EQ(ReadClockLog(take, {}).readings.size(), 1u);
  const auto recovered = RecoverRecordedTake(take, {.force = true});
  ASSERT_TRUE(recovered.ok()) << recovered.status();
  EXPECT_EQ(problems(), "");
  EXPECT_EQ(ReadClockLog(take, {ReadTakeFile(take)->clocks_checksum()}).readings.size(), 1u);
  EXPECT_EQ(ReadBytes(recovered->kept_aside() + "/clocks.csv"), damaged);
  WriteBytes(log, "something else");
  EXPECT_THAT(problems(), HasSubstr("clocks.csv: "));
}

// A camera that has ended, with what it says of itself.
class SettledCamera : public CameraSource {
 public:
  SettledCamera(std::string id, std::string problem, std::map<std::string, std::string> settings = {})
      : id_(std::move(id)), problem_(std::move(problem)), settings_(std::move(settings)) {}
  const std::string& camera_id() const override { return id_; }
  std::map<std::string, std::string> settings() const override { return settings_; }
  absl::Status Start() override { return absl::OkStatus(); }
  absl::StatusOr<CameraDelivery> Next(std::chrono::milliseconds) override {
    return absl::OutOfRangeError("the end");
  }
  void Stop() override {}
  std::string ClockProblem() const override { return problem_; }
  CameraCounters counters() const override { return {.frames = 5, .frames_lost = 4, .packets_resent = 3}; }

 private:
  const std::string id_, problem_;
  const std::map<std::string, std::string> settings_;
};

TEST(ClockWarnings, CamerasOfOneProblemAreOne) {
  std::vector<std::unique_ptr<CameraSource>> cameras;
  for (const char* id : {"a", "b"}) cameras.push_back(std::make_unique<SettledCamera>(id, "it reads 0"));
  cameras.push_back(std::make_unique<SettledCamera>("c", ""));
  cameras.push_back(std::make_unique<SettledCamera>("d", "it stands still"));
  EXPECT_THAT(
      ClockWarnings(cameras),
      ::testing::ElementsAre(
          "2 of 4 cameras (a and b): their clocks cannot be read, it reads 0; the arrival of frames stands "
          "in "
          "for them: sets are as good as the network is even; PTP makes them exact",
          "camera d: its clock cannot be read, it stands still; the arrival of frames stands in for it: sets "
          "are as good as the network is even; PTP makes them exact"));
}

// It ends by itself, since every camera has.
TEST(RecordLive, DescribesCamerasAndSession) {
  const TempFolder temp;
  std::vector<std::unique_ptr<CameraSource>> cameras;
  cameras.push_back(std::make_unique<SettledCamera>(
      "a", "it reads 0",
      std::map<std::string, std::string>{{"DeviceModelName", "M7"}, {"DeviceSerialNumber", "9"}}));
  cameras.push_back(std::make_unique<SettledCamera>(
      "b", "it reads 0", std::map<std::string, std::string>{{"PtpStatus", "Slave"}}));
  LiveRecordingOptions options = Options();
  options.seconds = 0;
  options.sets.tolerance_ns = 1'500'000;
  const std::atomic<bool> stop = false;
  size_t reports = 0;
  const auto take = RecordLive(temp / "take", cameras, options, stop, [&](const LiveRecordingState& state) {
    EXPECT_EQ(state.cameras.size(), 2u);
    EXPECT_EQ(state.cameras[0].receiver.frames, 5u);
    EXPECT_GT(state.elapsed_s, 0);
    ++reports;
  });
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_GE(reports, 1u);
  EXPECT_EQ(take->sync(), "free run, shared clocks, tolerance 1.500 ms, period 100.000 ms");
  EXPECT_FALSE(take->own_clocks());
  EXPECT_EQ(take->state(), v1::TAKE_STATE_COMPLETE);
  ASSERT_EQ(take->cameras_size(), 2);
  EXPECT_EQ(take->cameras(0).model(), "M7");
  EXPECT_EQ(take->cameras(0).serial(), "9");
  EXPECT_EQ(take->cameras(0).settings().at("DeviceModelName"), "M7");
  EXPECT_EQ(take->cameras(0).clock_problem(), "it reads 0");
  EXPECT_TRUE(take->cameras(0).own_clock());
  EXPECT_FALSE(take->cameras(1).own_clock()) << "PTP vouches for its times";
  EXPECT_EQ(take->cameras(0).packets_resent(), 3u);
  EXPECT_NE(take->clocks_checksum(), "");
  EXPECT_EQ(ReadTakeFile(temp / "take")->clocks_checksum(), take->clocks_checksum());
  const v1::TakeInfo info = *DescribeTake(temp / "take");
  EXPECT_THAT(info.notes(),
              ::testing::Contains(::testing::HasSubstr("its clock cannot be read: it reads 0")));
}

TEST(RecordLive, OfClocksThatAreAllTheirOwnTimesAreEstimated) {
  const TempFolder temp;
  std::vector<std::unique_ptr<CameraSource>> cameras;
  cameras.push_back(std::make_unique<SettledCamera>("a", "it reads 0"));
  LiveRecordingOptions options = Options();
  options.sets.period_ns = 0;
  const std::atomic<bool> stop = false;
  const auto take = RecordLive(temp / "take", cameras, options, stop);
  ASSERT_TRUE(take.ok()) << take.status();
  EXPECT_EQ(take->sync(), "free run, clocks of their own, tolerance 2.000 ms");
  EXPECT_TRUE(take->own_clocks());
}

}  // namespace
}  // namespace weft
