#include "services/studio/recording/replay_take.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/studio/recording/live_recording.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

// Sets 3 to 7; set 5 lacks the camera on the right.
void RecordReplayed(const std::string& folder, PatternFrames& cameras) {
  std::vector<RawFrameSet> sets;
  for (uint64_t number = 3; number < 8; ++number) sets.push_back(cameras.Set(number));
  sets[2].frames.pop_back();
  sets[2].missing.push_back({"right", "3 packets lost"});
  RecordSets(folder, cameras.camera_ids(), sets);
}

class ReplayTakeTest : public ::testing::Test {
 protected:
  ReplayTakeTest() { RecordReplayed(take_, cameras_); }

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
    EXPECT_EQ(summary.sets(), 5u);
    EXPECT_EQ(summary.frames(), 9u);
    EXPECT_EQ(summary.missing(), 1u);
    EXPECT_EQ(summary.bytes(), 9u * 4096);
    EXPECT_GT(summary.wall_s(), 0);
    EXPECT_LE(summary.late_median_ms(), summary.late_worst_ms());
    EXPECT_THAT(summary.checksum(), ::testing::MatchesRegex("[0-9a-f]{16}"));
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

TEST_F(ReplayTakeTest, EndsWhereNobodyWantsMore) {
  ReplayOptions options;
  options.mode = ReplayMode::kFastest;
  uint64_t sets = 0;
  const v1::TakeReplay summary =
      ReplayTake(**Replay::Open(take_, options),
                 [&](const RawFrameSet&, std::chrono::nanoseconds) { return ++sets < 2; });
  EXPECT_EQ(sets, 2u);
  EXPECT_EQ(summary.sets(), 2u);
  EXPECT_EQ(summary.frames(), 4u);
  // The bytes, the order and every number of the frames are in the sum.
  const v1::TakeReplay all =
      ReplayTake(**Replay::Open(take_, options), [](const RawFrameSet&, auto) { return true; });
  EXPECT_NE(summary.checksum(), all.checksum());
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
  options.recorder = SmallRecorder();
  size_t looked_at = 0;
  options.look = [&](const RawFrameSet&) { ++looked_at; };
  const std::atomic<bool> stop = false;
  const auto recorded = RecordLive(temp_ / "again", sources, options, stop);
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  const auto again = RecordedTake::Open(temp_ / "again");
  ASSERT_TRUE(again.ok()) << again.status();
  ASSERT_THAT((*again)->sets(), SizeIs(5));
  EXPECT_EQ(looked_at, 5u);
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
