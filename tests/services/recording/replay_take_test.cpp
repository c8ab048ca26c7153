#include "services/recording/replay_take.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/recording/live_recording.h"
#include "services/recording/take_file.h"
#include "tests/capture/pattern_frames.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

RecorderOptions Small() {
  RecorderOptions options;
  options.low_disk_bytes = 0;
  options.take.stream.preallocate_bytes = 0;
  return options;
}

// Sets 3 to 7; set 5 lacks the camera on the right.
void Record(const std::string& folder, PatternFrames& cameras) {
  RecorderOptions options = Small();
  v1::Take take = NewTake("test");
  options.take.take = TakeNumber(take);
  const auto recorder = Recorder::Start(folder, cameras.camera_ids(), options);
  ASSERT_TRUE(recorder.ok()) << recorder.status();
  ASSERT_TRUE(WriteTakeFile(folder, take).ok());
  for (uint64_t number = 3; number < 8; ++number) {
    RawFrameSet set = cameras.Set(number);
    if (number == 5) {
      set.frames.pop_back();
      set.missing.push_back({"right", "3 packets lost"});
    }
    ASSERT_TRUE((*recorder)->OfferAndWait(std::move(set)));
  }
  ASSERT_TRUE((*recorder)->Stop().ok());
}

class ReplayTakeTest : public ::testing::Test {
 protected:
  ReplayTakeTest() { Record(take_, cameras_); }

  const TempFolder temp_;
  const std::string take_ = temp_ / "take";
  PatternFrames cameras_{{"left", "right"}, 64, 48};
};

TEST_F(ReplayTakeTest, HandsOutEverySetInOrderAndTheSameEachTime) {
  ReplayOptions options;
  options.mode = ReplayMode::kFastest;
  std::string checksum;
  for (int run = 0; run < 2; ++run) {
    const auto replay = Replay::Open(take_, options);
    ASSERT_TRUE(replay.ok()) << replay.status();
    std::vector<uint64_t> numbers;
    const v1::TakeReplay summary =
        ReplayTake(**replay, [&](const RawFrameSet& set, std::chrono::nanoseconds) {
          numbers.push_back(set.number);
          for (const RawFrame& frame : set.frames)
            EXPECT_TRUE(cameras_.IsExact(frame, frame.camera_id == "right", set.number));
          return true;
        });
    EXPECT_THAT(numbers, ElementsAre(3, 4, 5, 6, 7));
    EXPECT_EQ(summary.frames(), 9u);
    EXPECT_EQ(summary.missing(), 1u);
    if (run > 0) {
      EXPECT_EQ(summary.checksum(), checksum);
    }
    checksum = summary.checksum();
  }
  options.view.shift_ns["left"] = 1;
  EXPECT_NE(
      ReplayTake(**Replay::Open(take_, options), [](const RawFrameSet&, auto) { return true; }).checksum(),
      checksum);
}

TEST_F(ReplayTakeTest, IsRecordedLikeLiveCameras) {
  const auto replay = Replay::Open(take_, {});
  ASSERT_TRUE(replay.ok()) << replay.status();
  std::vector<std::unique_ptr<CameraSource>> sources;
  for (const std::string& id : cameras_.camera_ids()) sources.push_back(*OpenReplayCamera(*replay, id));
  LiveRecordingOptions options;
  options.sets.period_ns = 33'333'333;
  options.sets.start_wait_ns = 1'000'000'000;
  options.sets.max_wait_ns = 5'000'000'000;
  options.recorder = Small();
  const std::atomic<bool> stop = false;
  const auto recorded = RecordLive(temp_ / "again", sources, options, stop);
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  const auto again = RecordedTake::Open(temp_ / "again");
  ASSERT_TRUE(again.ok()) << again.status();
  ASSERT_THAT((*again)->sets(), SizeIs(5));
  for (size_t set = 0; set < 5; ++set)
    for (size_t camera = 0; camera < 2; ++camera) {
      const auto frame = (*again)->ReadRaw(set, camera);
      if (set == 2 && camera == 1) {
        EXPECT_EQ(frame.status(), absl::NotFoundError("3 packets lost"));
      } else {
        ASSERT_TRUE(frame.ok()) << frame.status();
        EXPECT_TRUE(cameras_.IsExact(*frame, camera, 3 + set));
      }
    }
}

}  // namespace
}  // namespace weft
