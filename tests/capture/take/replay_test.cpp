#include "capture/take/replay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "capture/take/take_writer.h"
#include "tests/capture/pattern_frames.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr uint64_t kFirst = 3, kSets = 5;

PatternFrames TwoFilmed() { return {{"left", "right"}, 100, 61}; }

// Sets 3 to 7, 33.3 ms apart; set 5 lacks the camera on the right.
void RecordTwo(const std::string& folder) {
  PatternFrames cameras = TwoFilmed();
  TakeWriterOptions options;
  options.stream.preallocate_bytes = 1 << 20;
  const auto writer = TakeWriter::Create(folder, cameras.camera_ids(), options);
  ASSERT_TRUE(writer.ok()) << writer.status();
  std::vector<LedgerEntry> entries;
  for (uint64_t number = kFirst; number < kFirst + kSets; ++number) {
    RawFrameSet set = cameras.Set(number);
    if (number == 5) {
      set.frames.pop_back();
      set.missing.push_back({"right", "3 packets lost"});
    }
    for (size_t camera = 0; camera < 2; ++camera) ASSERT_TRUE((*writer)->Append(camera, set).ok());
    for (const LedgerEntry& entry : EntriesOfRecorded(set, 1)) entries.push_back(entry);
  }
  ASSERT_TRUE((*writer)->Commit(kFirst + kSets - 1, entries).ok());
  ASSERT_TRUE((*writer)->Close(kFirst + kSets - 1, {}, {}).ok());
}

class ReplayTest : public ::testing::Test {
 protected:
  ReplayTest() { RecordTwo(take_); }
  std::unique_ptr<CameraSource> Open(const std::string& camera) {
    auto replay = Replay::Open(take_, options_);
    EXPECT_TRUE(replay.ok()) << replay.status();
    auto source = OpenReplayCamera(*replay, camera);
    EXPECT_TRUE(source.ok()) << source.status();
    return *std::move(source);
  }

  const TempFolder temp_;
  const std::string take_ = temp_ / "take";
  ReplayOptions options_;
};

TEST_F(ReplayTest, DeliversWhatWasRecordedBitByBit) {
  options_.mode = ReplayMode::kFastest;
  const PatternFrames cameras = TwoFilmed();
  for (size_t camera = 0; camera < 2; ++camera) {
    const auto source = Open(cameras.camera_ids()[camera]);
    ASSERT_TRUE(source->Start().ok());
    EXPECT_EQ(source->settings()["PixelFormat"], "BayerRG8");
    for (uint64_t set = kFirst; set < kFirst + kSets; ++set) {
      const auto delivery = source->Next(milliseconds(0));
      ASSERT_TRUE(delivery.ok()) << delivery.status();
      if (set == 5 && camera == 1) {
        EXPECT_EQ(delivery->kind, CameraDelivery::Kind::kLostFrame);
        EXPECT_EQ(delivery->cause, "3 packets lost");
        EXPECT_NEAR(static_cast<double>(delivery->frame.device_time_ns), 5 * 33'333'333, 5);
      } else {
        EXPECT_TRUE(cameras.IsExact(delivery->frame, camera, set)) << set;
      }
    }
    EXPECT_EQ(source->Next(milliseconds(0)).status().code(), absl::StatusCode::kOutOfRange);
  }
}

TEST_F(ReplayTest, NoFrameComesBeforeItsTime) {
  for (const double speed : {1.0, 4.0}) {
    options_.speed = speed;
    const auto source = Open("left");
    const auto begin = std::chrono::steady_clock::now();
    for (uint64_t set = 0; set < kSets; ++set) {
      auto delivery = source->Next(milliseconds(1));
      while (absl::IsDeadlineExceeded(delivery.status())) delivery = source->Next(milliseconds(1));
      ASSERT_TRUE(delivery.ok());
      // The clock starts with the last frame of the first set, which is that of the other camera.
      const auto since = std::chrono::steady_clock::now() - begin;
      const double recorded_ms = 33.333333 * static_cast<double>(set) - 1e-6;
      EXPECT_GE(std::chrono::duration<double>(since).count() * 1e3, recorded_ms / speed - 1e-3);
    }
  }
}

TEST_F(ReplayTest, StepsSetBySet) {
  options_.mode = ReplayMode::kStepwise;
  auto replay = Replay::Open(take_, options_);
  ASSERT_TRUE(replay.ok());
  const auto left = *OpenReplayCamera(*replay, "left");
  const auto right = *OpenReplayCamera(*replay, "right");
  EXPECT_TRUE(absl::IsDeadlineExceeded(left->Next(milliseconds(1)).status()));
  for (uint64_t set = kFirst; set < kFirst + kSets; ++set) {
    ASSERT_TRUE(left->Trigger().ok());
    EXPECT_TRUE(left->Next(milliseconds(1)).ok());
    EXPECT_TRUE(right->Next(milliseconds(1)).ok());
    EXPECT_FALSE(left->Next(milliseconds(1)).ok());
  }
}

TEST_F(ReplayTest, ShiftsTakeFramesToTheSetsOfTheirNewTime) {
  TakeViewOptions options;
  options.shift_ns["right"] = 34'000'000;
  options.first_set = 4;
  options.last_set = 6;
  const auto view = TakeView::Open(take_, options);
  ASSERT_TRUE(view.ok()) << view.status();
  EXPECT_THAT(view->sets(), ElementsAre(4, 5, 6));
  PatternFrames cameras = TwoFilmed();
  const RawFrame expected = cameras.Frame(1, 3);
  const auto frame = view->ReadRaw(0, 1);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->device_frame_id, expected.device_frame_id);
  EXPECT_EQ(frame->device_time_ns, expected.device_time_ns + 34'000'000);
  EXPECT_EQ(frame->host_time_ns, expected.host_time_ns + 34'000'000);
  EXPECT_EQ(view->ReadRaw(2, 1).status(), absl::NotFoundError("3 packets lost"));
  EXPECT_TRUE(cameras.IsExact(*view->ReadRaw(2, 0), 0, 6));

  options.first_set = 3;
  const auto begin = TakeView::Open(take_, options);
  EXPECT_THAT(std::string(begin->ReadRaw(0, 1).status().message()), HasSubstr("shifted stream has no frame"));
  options.shift_ns = {{"right", 300'000}};  // far less than a period
  EXPECT_EQ(TakeView::Open(take_, options)->ReadRaw(0, 1)->device_time_ns, expected.device_time_ns + 300'000);
  options.shift_ns = {{"up", 1}};
  EXPECT_THAT(std::string(TakeView::Open(take_, options).status().message()), HasSubstr("camera up"));
  options_.speed = 0;
  EXPECT_FALSE(Replay::Open(take_, options_).ok());
}

}  // namespace
}  // namespace weft
