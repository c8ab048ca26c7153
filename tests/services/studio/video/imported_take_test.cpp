#include "services/studio/video/imported_take.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "capture/sync/ledger.h"
#include "capture/take/stream_reader.h"
#include "capture/take/take_files.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/video/video_facts.h"
#include "tests/services/studio/video/made_video.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A film of 8 frames at 25 a second that begins 0.08 s after the first of 12 sets. Its frame 3 belongs to no
// set: a frame of another camera's time is missing there.
class ImportedTakeTest : public ::testing::Test {
 protected:
  ImportedTakeTest() {
    MakeVideo(temp_ / "a.mkv", Values(10, 8), "25");
    auto facts = InspectVideo(fs::canonical(temp_ / "a.mkv").string());
    EXPECT_TRUE(facts.ok()) << facts.status();
    videos_.push_back(facts.value_or(v1::VideoFacts()));
    videos_[0].set_camera("left");
    take_ = NewTake("videos a.mkv");
    v1::TakeCamera& camera = *take_.add_cameras();
    camera.set_id("left");
    camera.mutable_sync()->set_offset_s(0.08);
    camera.mutable_sync()->set_period_ms(40);
    take_.set_ended_host_time_ns(77);
    take_.set_sets_recorded(12);
    take_.set_frames_missing(5);
    plan_.frames = {{-1, -1, 0, 1, 2, -1, 4, 5, 6, 7, -1, -1}};
    for (int i = 0; i < 12; ++i) plan_.set_times_s.push_back(0.04 * i);
    for (int i = 0; i < 8; ++i) times_s_.push_back(0.08 + 0.04 * i);
    fs::create_directories(StreamFolder(folder_));
    stream_.preallocate_bytes = 0;
  }
  ImportedTake Imported() const { return {folder_, take_, videos_, plan_, {times_s_}, stream_, {}}; }
  absl::Status Write() {
    done_ = 0;
    return WriteCameraStream(Imported(), 0, [this] { return ++done_ < most_; });
  }
  std::unique_ptr<StreamReader> Read() const {
    auto stream = StreamReader::Open(StreamFolder(folder_), "left");
    EXPECT_TRUE(stream.ok()) << stream.status();
    return stream.ok() ? *std::move(stream) : nullptr;
  }
  std::vector<LedgerEntry> Ledger() const {
    const auto ledger = ParseLedger(ReadBytes(LedgerFile(folder_)));
    EXPECT_TRUE(ledger.ok()) << ledger.status();
    EXPECT_EQ(ledger->damage, "");
    return ledger->entries;
  }

  const TempFolder temp_;
  const std::string folder_ = temp_ / "take";
  v1::Take take_;
  std::vector<v1::VideoFacts> videos_;
  FramePlan plan_;
  std::vector<double> times_s_;
  StreamWriterOptions stream_;
  int done_ = 0, most_ = std::numeric_limits<int>::max();
};

TEST(ImportedTake, CountsTheGapsOfThePlan) {
  FramePlan plan;
  EXPECT_EQ(FramesMissing(plan), 0u);
  plan.frames = {{0, -1, 1}, {-1, -1, 0}, {0, 1, 2}};
  EXPECT_EQ(FramesMissing(plan), 3u);
}

TEST_F(ImportedTakeTest, AStreamHasEveryFrameOfThePlanAndTheReasonOfEveryGap) {
  ASSERT_TRUE(Write().ok());
  EXPECT_EQ(done_, 12);
  const auto stream = Read();
  ASSERT_NE(stream, nullptr);
  EXPECT_EQ(stream->header().take, TakeNumber(take_));
  EXPECT_EQ(stream->header().camera_id, "left");
  EXPECT_EQ(stream->header().description, StreamDescription(take_, 0));
  ASSERT_EQ(stream->records().size(), 12u);
  for (const auto& [set, value] :
       std::vector<std::pair<size_t, int>>{{2, 10}, {3, 11}, {4, 12}, {6, 14}, {9, 17}}) {
    const auto frame = stream->Read(stream->records()[set]);
    ASSERT_TRUE(frame.ok()) << frame.status();
    EXPECT_EQ(frame->bytes->data()[0], value);
    EXPECT_EQ(frame->camera_id, "left");
    EXPECT_EQ(frame->device_frame_id, static_cast<uint64_t>(value - 10));
    EXPECT_EQ(frame->device_time_ns, 80'000'000 + (value - 10) * 40'000'000);
  }
  for (const auto& [set, why] :
       std::vector<std::pair<size_t, std::string>>{{0, "the video begins later"},
                                                   {1, "the video begins later"},
                                                   {5, "the video has no frame at this time"},
                                                   {10, "the video has ended"},
                                                   {11, "the video has ended"}}) {
    EXPECT_EQ(stream->Read(stream->records()[set]).status().message(), why) << set;
    EXPECT_EQ(stream->records()[set].device_time_ns, static_cast<int64_t>(set) * 40'000'000);
  }
  ASSERT_TRUE(stream->end());
  EXPECT_EQ(stream->end()->ended_host_time_ns, 77);
  EXPECT_EQ(stream->end()->sets_recorded, 12u);
  EXPECT_EQ(stream->end()->frames_missing, 5u);
  EXPECT_EQ(stream->end()->outcome, TakeOutcome::kComplete);
}

// Matroska counts milliseconds: the gap of set 5 is 120 ms after the film's first picture.
TEST_F(ImportedTakeTest, AGapIsOfDamageWhereADamagedPictureIsWithinHalfAPeriod) {
  ASSERT_EQ(videos_[0].time_base_den(), 1000);
  for (const auto& [pts, is_damage] : std::vector<std::pair<int64_t, bool>>{
           {98, false}, {100, true}, {120, true}, {140, true}, {142, false}}) {
    videos_[0].clear_damaged_pts();
    videos_[0].add_damaged_pts(pts);
    ASSERT_TRUE(WriteLedger(Imported(), {}).ok());
    std::vector<std::string> why;
    for (const LedgerEntry& entry : Ledger())
      if (entry.event == LedgerEvent::kMissing && entry.first_set == 5) why.push_back(entry.cause);
    EXPECT_THAT(why, ElementsAre(is_damage ? "the video is damaged at this time"
                                           : "the video has no frame at this time"))
        << pts;
  }
}

TEST_F(ImportedTakeTest, AStreamThatStandsThereIsNotWrittenAgain) {
  ASSERT_TRUE(Write().ok());
  const auto before = fs::last_write_time(StreamFile(StreamFolder(folder_), "left"));
  fs::remove(temp_ / "a.mkv");
  ASSERT_TRUE(Write().ok());
  EXPECT_EQ(done_, 12);
  EXPECT_EQ(fs::last_write_time(StreamFile(StreamFolder(folder_), "left")), before);
  // That of another take is none of ours, nor one of another plan.
  const v1::Take take = take_;
  take_.set_id("00000000000000ff");
  EXPECT_FALSE(Write().ok());
}

TEST_F(ImportedTakeTest, WhatAnEarlierTryLeftIsReplaced) {
  WriteBytes(StreamFile(StreamFolder(folder_), "left"), "half a stream");
  WriteBytes(IndexFile(StreamFolder(folder_), "left"), "half an index");
  most_ = 3;
  EXPECT_TRUE(absl::IsCancelled(Write()));
  EXPECT_EQ(done_, 3);
  EXPECT_FALSE(Read()->end()) << "it was stopped";
  most_ = std::numeric_limits<int>::max();
  ASSERT_TRUE(Write().ok());
  EXPECT_EQ(Read()->records().size(), 12u);
}

TEST_F(ImportedTakeTest, FramesAfterTheLastSetAreReadTooAndCompared) {
  plan_.frames[0] = {-1, -1, 0};
  plan_.set_times_s.resize(3);
  EXPECT_TRUE(Write().ok());
  // The file holds one frame less than it did.
  plan_.set_times_s.push_back(0.12);
  plan_.frames[0].push_back(1);
  videos_[0].add_frame_pts(320);
  const absl::Status changed = Write();
  EXPECT_TRUE(absl::IsDataLoss(changed));
  EXPECT_THAT(std::string(changed.message()), HasSubstr("it gives fewer frames than at first"));
}

TEST_F(ImportedTakeTest, TheLedgerNamesEverySetEveryGapAndEveryNote) {
  ASSERT_TRUE(WriteLedger(Imported(), {{"left", "it films sets 2 to 9", true}, {"", "of all", false}}).ok());
  const std::vector<LedgerEntry> ledger = Ledger();
  ASSERT_EQ(ledger.size(), 2u + 12 + 5 + 1);
  EXPECT_EQ(ledger[0], (LedgerEntry{LedgerEvent::kNote, 0, 0, 0, 77, "left", "it films sets 2 to 9"}));
  EXPECT_EQ(ledger[1], (LedgerEntry{LedgerEvent::kNote, 0, 0, 0, 77, "", "of all"}));
  uint64_t recorded = 0, missing = 0;
  for (const LedgerEntry& entry : ledger) {
    if (entry.event == LedgerEvent::kRecorded) {
      EXPECT_EQ(entry.first_set, recorded);
      EXPECT_EQ(entry.device_time_ns, static_cast<int64_t>(recorded) * 40'000'000);
      ++recorded;
    }
    if (entry.event != LedgerEvent::kMissing) continue;
    EXPECT_EQ(entry.camera_id, "left");
    ++missing;
  }
  EXPECT_EQ(recorded, 12u);
  EXPECT_EQ(missing, 5u);
  EXPECT_EQ(ledger.back().event, LedgerEvent::kEnd);
  EXPECT_EQ(ledger.back().last_set, 11u);
}

// A picture takes up to three bytes a pixel.
TEST_F(ImportedTakeTest, RoomIsAskedForBesideWhatAnEarlierTryWrote) {
  EXPECT_TRUE(CheckRoom(Imported(), "OUT").ok());
  const double available = static_cast<double>(fs::space(folder_).available);
  // As wide as the disk has pixels: some thousand times what it has room for.
  videos_[0].set_width_px(std::numeric_limits<int>::max());
  videos_[0].set_height_px(static_cast<int>(std::min(2e9, available / 1e6)));
  const absl::Status full = CheckRoom(Imported(), "OUT");
  EXPECT_TRUE(absl::IsResourceExhausted(full));
  EXPECT_THAT(std::string(full.message()), AllOf(HasSubstr("OUT: the pictures take up to "),
                                                 HasSubstr("name another disk, or --compress")));
  // Nobody knows how small they become.
  stream_.compress = true;
  EXPECT_TRUE(CheckRoom(Imported(), "OUT").ok());
  // 10 % more than there is, of which a file that takes no room on the disk is written already.
  stream_.compress = false;
  videos_[0].set_width_px(1'000'000);
  videos_[0].set_height_px(static_cast<int>(1.1 * available / (3e6 * videos_[0].frame_pts_size())));
  EXPECT_FALSE(CheckRoom(Imported(), "OUT").ok());
  WriteBytes(StreamFile(StreamFolder(folder_), "left"), "");
  fs::resize_file(StreamFile(StreamFolder(folder_), "left"), static_cast<uintmax_t>(0.2 * available));
  EXPECT_TRUE(CheckRoom(Imported(), "OUT").ok());
}

}  // namespace
}  // namespace weft
