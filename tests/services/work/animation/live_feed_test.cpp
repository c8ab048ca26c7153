#include "services/work/animation/live_feed.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "base/host_clock.h"
#include "capture/take/open_dump.h"
#include "services/studio/recording/take_verdict.h"
#include "tests/animation/drive_room.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

constexpr int kWidthPx = 64, kHeightPx = 48;
constexpr double kFps = 30;

class LiveFeedTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        testing::TempDir() + "/live_feed_" + testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
    for (const std::string& id : cameras_.camera_ids()) {
      CameraModel camera = CameraAt(id, 0, Eigen::Vector3d::Zero());
      camera.width_px = kWidthPx, camera.height_px = kHeightPx;
      rig_.cameras.push_back(camera);
    }
  }
  std::unique_ptr<Recorder> Start() {
    RecorderOptions options = SmallRecorder();
    options.flush_interval_ms = 5;
    auto recorder = Recorder::Start(folder_, cameras_.camera_ids(), options);
    EXPECT_TRUE(recorder.ok()) << recorder.status();
    return *std::move(recorder);
  }
  // Until the recorder has flushed so many sets.
  static void WaitFor(const Recorder& recorder, uint64_t sets) {
    while (recorder.Counters().sets_recorded < sets)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }

  PatternFrames cameras_{{"left", "right"}, kWidthPx, kHeightPx};
  Rig rig_;
  std::string folder_;
  std::stop_source stop_;
};

TEST_F(LiveFeedTest, FollowsARecorderAndPassesOverWhatANewerFrameOvertook) {
  std::unique_ptr<Recorder> recorder = Start();
  const std::unique_ptr<LiveFeed> feed = FollowTake(folder_, rig_, "", kFps);
  EXPECT_TRUE(IsBeingRecorded(folder_));
  ASSERT_TRUE(recorder->OfferAndWait(cameras_.Set(5)));
  const auto first = feed->Newest(stop_.get_token());
  ASSERT_TRUE(first.ok() && first->has_value()) << first.status();
  EXPECT_EQ((*first)->name, "0005");
  EXPECT_EQ((*first)->passed_over, 0);
  for (const uint64_t number : {6, 7, 9}) ASSERT_TRUE(recorder->OfferAndWait(cameras_.Set(number)));
  WaitFor(*recorder, 4);
  const int64_t asked_ns = HostTime_ns();
  const auto second = feed->Newest(stop_.get_token());
  ASSERT_TRUE(second.ok() && second->has_value()) << second.status();
  EXPECT_EQ((*second)->name, "0009");
  EXPECT_EQ((*second)->passed_over, 2);
  EXPECT_EQ((*second)->time_ns - (*first)->time_ns,
            cameras_.Set(9).device_time_ns - cameras_.Set(5).device_time_ns);
  EXPECT_LT((*second)->arrived_ns, asked_ns);
  const auto picture = (*second)->source->ReadView((*second)->index, 1);
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ(picture->origin, "camera right, frame 0009");
  // As whoever opens the take has it.
  const auto dump = OpenDump(folder_, rig_);
  ASSERT_TRUE(dump.ok()) << dump.status();
  EXPECT_EQ((*dump)->frame_names().back(), "0009");
  EXPECT_EQ(*(*second)->source->Fingerprint((*second)->index), *(*dump)->Fingerprint(3));
  RawFrameSet incomplete = cameras_.Set(10);
  incomplete.frames.pop_back();
  incomplete.missing.push_back({"right", "3 packets lost"});
  ASSERT_TRUE(recorder->OfferAndWait(incomplete));
  ASSERT_TRUE(recorder->Stop().ok());
  const auto last = feed->Newest(stop_.get_token());
  ASSERT_TRUE(last.ok() && last->has_value()) << last.status();
  EXPECT_EQ((*last)->name, "0010");
  EXPECT_TRUE((*last)->source->ReadView(0, 0).ok());
  EXPECT_EQ((*last)->source->ReadView(0, 1).status().message(), "3 packets lost");
  EXPECT_EQ(*(*last)->source->Fingerprint(0), *(*OpenDump(folder_, rig_))->Fingerprint(4));
  EXPECT_FALSE(feed->Newest(stop_.get_token())->has_value());
  recorder.reset();
  EXPECT_FALSE(IsBeingRecorded(folder_));
  // Who goes on after a frame is not given it again.
  EXPECT_EQ((**FollowTake(folder_, rig_, "0009", kFps)->Newest(stop_.get_token())).name, "0010");
  EXPECT_FALSE(FollowTake(folder_, rig_, "0010", kFps)->Newest(stop_.get_token())->has_value());
}

TEST_F(LiveFeedTest, WaitsNoLongerOnceItIsToStop) {
  const std::unique_ptr<Recorder> recorder = Start();
  ASSERT_TRUE(recorder->OfferAndWait(cameras_.Set(0)));
  const std::unique_ptr<LiveFeed> feed = FollowTake(folder_, rig_, "", kFps);
  ASSERT_TRUE(feed->Newest(stop_.get_token())->has_value());
  std::jthread later([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    stop_.request_stop();
  });
  EXPECT_FALSE(feed->Newest(stop_.get_token())->has_value());
}

TEST_F(LiveFeedTest, PlaysARecordingInItsRhythm) {
  RecordPattern(folder_, cameras_);  // sets 5 to 8
  auto dump = OpenDump(folder_, rig_);
  ASSERT_TRUE(dump.ok()) << dump.status();
  const std::shared_ptr<const FrameSource> source = *std::move(dump);
  constexpr int64_t kStep_ns = 40'000'000;
  const DriveFrameList list{source, {0, 1, 2, 3}, {0, kStep_ns, 2 * kStep_ns, 3 * kStep_ns}};
  const std::unique_ptr<LiveFeed> feed = PlayFrames(list, 2);
  const auto first = feed->Newest(stop_.get_token());
  EXPECT_EQ((*first)->name, "0005");
  const auto second = feed->Newest(stop_.get_token());
  EXPECT_EQ((*second)->name, "0006");
  EXPECT_EQ((*second)->arrived_ns - (*first)->arrived_ns, kStep_ns / 2);
  EXPECT_GE(HostTime_ns(), (*second)->arrived_ns);
  std::this_thread::sleep_for(std::chrono::nanoseconds(kStep_ns));
  const auto last = feed->Newest(stop_.get_token());
  EXPECT_EQ((*last)->name, "0008");
  EXPECT_EQ((*last)->passed_over, 1);
  EXPECT_EQ((*last)->time_ns, 3 * kStep_ns);
  EXPECT_FALSE(feed->Newest(stop_.get_token())->has_value());
}

}  // namespace
}  // namespace weft
