#include "services/studio/recording/recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <set>

#include "capture/take/recorded_take.h"
#include "capture/take/recover_take.h"
#include "capture/take/take_files.h"
#include "tests/capture/file_size_limit.h"
#include "tests/capture/pattern_frames.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

RecorderOptions Small() {
  RecorderOptions options;
  options.flush_interval_ms = 5;
  options.low_disk_bytes = 0;
  options.take.stream.preallocate_bytes = 1 << 20;
  return options;
}

// Every set from 0 to `offered` stands in the ledger once, as recorded or as dropped; recorded ones are
// exact.
void ExpectAccounted(const std::string& folder, PatternFrames& cameras, uint64_t offered) {
  const auto take = RecordedTake::Open(folder);
  ASSERT_TRUE(take.ok()) << take.status();
  std::set<uint64_t> accounted, recorded;
  for (const LedgerEntry& entry : (*take)->ledger()) {
    if (entry.event != LedgerEvent::kRecorded && entry.event != LedgerEvent::kDropped) continue;
    for (uint64_t set = entry.first_set; set <= entry.last_set; ++set) {
      EXPECT_TRUE(accounted.insert(set).second) << set;
      if (entry.event == LedgerEvent::kRecorded) recorded.insert(set);
    }
    EXPECT_EQ(entry.cause.empty(), entry.event == LedgerEvent::kRecorded);
  }
  EXPECT_EQ(accounted.size(), offered);
  EXPECT_EQ(std::set<uint64_t>((*take)->sets().begin(), (*take)->sets().end()), recorded);
  for (size_t i = 0; i < (*take)->sets().size(); ++i)
    for (size_t camera = 0; camera < cameras.camera_ids().size(); ++camera) {
      const auto frame = (*take)->ReadRaw(i, camera);
      ASSERT_TRUE(frame.ok()) << frame.status();
      EXPECT_TRUE(cameras.IsExact(*frame, camera, (*take)->sets()[i]));
    }
  EXPECT_THAT(VerifyTake(folder)->problems, IsEmpty());
}

TEST(Recorder, RecordsEverySetAndAcknowledgesThemInOrder) {
  const TempFolder temp;
  PatternFrames cameras({"a", "b", "c"}, 64, 40);
  std::vector<uint64_t> acknowledged;
  auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), Small(),
                                  [&](uint64_t set) { acknowledged.push_back(set); });
  ASSERT_TRUE(recorder.ok()) << recorder.status();
  for (uint64_t set = 0; set < 200; ++set) EXPECT_TRUE((*recorder)->Offer(cameras.Set(set)));
  EXPECT_TRUE((*recorder)->Stop().ok());
  EXPECT_EQ((*recorder)->Counters().sets_recorded, 200u);
  EXPECT_TRUE(std::is_sorted(acknowledged.begin(), acknowledged.end()));
  ExpectAccounted(temp / "take", cameras, 200);
}

TEST(Recorder, DropsWholeSetsWhenTheQueueIsFullAndStaysWithinIt) {
  const TempFolder temp;
  PatternFrames cameras({"a", "b"}, 1024, 1024);
  RecorderOptions options = Small();
  options.queue_bytes = uint64_t{6} << 20;
  auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), options);
  ASSERT_TRUE(recorder.ok());
  uint64_t refused = 0;
  for (uint64_t set = 0; set < 300; ++set) refused += !(*recorder)->Offer(cameras.Set(set));
  EXPECT_TRUE((*recorder)->Stop().ok());
  const RecorderCounters counters = (*recorder)->Counters();
  EXPECT_LE(counters.queued_bytes_peak, options.queue_bytes);
  EXPECT_EQ(counters.sets_dropped, refused);
  EXPECT_EQ(counters.sets_recorded + counters.sets_dropped, 300u);
  ExpectAccounted(temp / "take", cameras, 300);
}

TEST(Recorder, WaitsForTheDiskWhereTheSourceCan) {
  const TempFolder temp;
  PatternFrames cameras({"a"}, 1024, 1024);
  RecorderOptions options = Small();
  options.queue_bytes = uint64_t{2} << 20;
  auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), options);
  ASSERT_TRUE(recorder.ok());
  for (uint64_t set = 0; set < 50; ++set) EXPECT_TRUE((*recorder)->OfferAndWait(cameras.Set(set)));
  EXPECT_TRUE((*recorder)->Stop().ok());
  ExpectAccounted(temp / "take", cameras, 50);
}

TEST(Recorder, StopsAtTheLowDiskMarkAndKeepsWhatItHas) {
  const TempFolder temp;
  PatternFrames cameras({"a", "b"}, 64, 40);
  RecorderOptions options = Small();
  options.low_disk_bytes = uint64_t{1} << 62;  // reached from the start
  auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), options);
  ASSERT_TRUE(recorder.ok());
  uint64_t set = 0;
  while ((*recorder)->Offer(cameras.Set(set++)) && set < 1'000'000) {
  }
  EXPECT_TRUE((*recorder)->Stop().ok());
  EXPECT_THAT((*recorder)->Counters().stop_cause, HasSubstr("disk nearly full"));
  ExpectAccounted(temp / "take", cameras, set);
}

// An eighth of the room above the mark is reserved for all cameras together; other programs use the disk,
// too.
TEST(Recorder, ReservesNoMoreForManyCamerasThanForOne) {
  const TempFolder temp;
  const uint64_t above_bytes = uint64_t{512} << 20;
  const uint64_t before_bytes = std::filesystem::space(temp.path()).available;
  if (before_bytes < 4 * above_bytes) GTEST_SKIP() << "this disk is nearly full";
  RecorderOptions options = Small();
  options.low_disk_bytes = before_bytes - above_bytes;
  options.take.stream.preallocate_bytes = above_bytes;
  const std::vector<std::string> ids = {"a", "b", "c", "d"};
  const auto recorder = Recorder::Start(temp / "take", ids, options);
  ASSERT_TRUE(recorder.ok()) << recorder.status();
  uint64_t reserved_bytes = 0;
  for (const std::string& id : ids) {
    struct stat info = {};
    ASSERT_EQ(stat(StreamFile(StreamFolder(temp / "take"), id).c_str(), &info), 0);
    reserved_bytes += static_cast<uint64_t>(info.st_blocks) * 512;
  }
  EXPECT_GT(reserved_bytes, above_bytes / 32);
  EXPECT_LT(reserved_bytes, above_bytes / 4);
  EXPECT_TRUE((*recorder)->Stop().ok());
}

TEST(Recorder, RefusesSetsThatDoNotAccountForEveryCamera) {
  const TempFolder temp;
  PatternFrames cameras({"a", "b"}, 64, 40);
  auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), Small());
  ASSERT_TRUE(recorder.ok());
  EXPECT_TRUE((*recorder)->Offer(cameras.Set(0)));
  RawFrameSet part = cameras.Set(1);
  part.frames.pop_back();
  EXPECT_FALSE((*recorder)->Offer(part));
  RawFrameSet torn = cameras.Set(2);
  torn.frames[0].height_px += 1;
  EXPECT_FALSE((*recorder)->Offer(torn));
  EXPECT_TRUE((*recorder)->Offer(cameras.Set(3)));
  EXPECT_TRUE((*recorder)->Stop().ok());
  ExpectAccounted(temp / "take", cameras, 4);
  std::vector<std::string> causes;
  const auto take = RecordedTake::Open(temp / "take");
  ASSERT_TRUE(take.ok());
  for (const LedgerEntry& entry : (*take)->ledger())
    if (entry.event == LedgerEvent::kDropped) causes.push_back(entry.cause);
  EXPECT_THAT(causes, ElementsAre("refused: it accounts for camera b 0 times",
                                  HasSubstr("refused: camera a: 2560 bytes, expected 2624")));
}

TEST(Recorder, WritesNotesAndDropsOfTheSourceToTheLedger) {
  const TempFolder temp;
  PatternFrames cameras({"a"}, 64, 40);
  auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), Small());
  ASSERT_TRUE(recorder.ok());
  (*recorder)->Note("a", "lost for 3 s, then found again");
  (*recorder)->NoteDropped(0, 4, 9, "no camera delivered");
  EXPECT_TRUE((*recorder)->Offer(cameras.Set(5)));
  EXPECT_TRUE((*recorder)->Stop().ok());
  EXPECT_TRUE((*recorder)->Stop().ok());
  EXPECT_EQ((*recorder)->Counters().sets_dropped, 5u);
  ExpectAccounted(temp / "take", cameras, 6);
}

TEST(RecorderOptions, AreChecked) {
  EXPECT_TRUE(RecorderOptions().Validate().ok());
  RecorderOptions options;
  for (const auto& [writers, is_good] :
       {std::pair{0, false}, std::pair{1, true}, std::pair{64, true}, std::pair{65, false}}) {
    options.writers = writers;
    EXPECT_EQ(options.Validate().ok(), is_good) << writers;
  }
  for (int RecorderOptions::*field : {&RecorderOptions::flush_interval_ms, &RecorderOptions::slow_write_ms,
                                      &RecorderOptions::stop_timeout_ms}) {
    options = {};
    options.*field = 1;
    EXPECT_TRUE(options.Validate().ok());
    options.*field = 0;
    EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("_ms must be positive"));
  }
  const TempFolder temp;
  options = Small();
  options.writers = 0;
  EXPECT_EQ(Recorder::Start(temp / "take", {"a"}, options).status().message(), "writers must be 1 to 64");
}

// Drops of one cause that follow each other are one line.
TEST(Recorder, CountsWhatItIsOfferedAndJoinsDrops) {
  const TempFolder temp;
  PatternFrames cameras({"a", "b"}, 64, 40);
  RecorderOptions options = Small();
  options.flush_interval_ms = 60'000;
  auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), options);
  ASSERT_TRUE(recorder.ok());
  (*recorder)->NoteDropped(0, 2, 7, "late");
  (*recorder)->NoteDropped(3, 3, 8, "late");
  (*recorder)->NoteDropped(4, 4, 9, "later");
  (*recorder)->NoteDropped(6, 6, 10, "later");
  RawFrameSet part = cameras.Set(7);
  part.frames.pop_back();
  part.missing.push_back({"b", "3 packets lost"});
  EXPECT_TRUE((*recorder)->Offer(part));
  EXPECT_TRUE((*recorder)->Offer(cameras.Set(8)));
  EXPECT_FALSE((*recorder)->Offer(cameras.Set(8))) << "twice";
  EXPECT_TRUE((*recorder)->Stop().ok());
  const RecorderCounters counters = (*recorder)->Counters();
  EXPECT_EQ(counters.sets_offered, 6u + 3);  // with those that the source dropped
  EXPECT_EQ(counters.sets_recorded, 2u);
  EXPECT_EQ(counters.sets_dropped, 6u + 1);
  EXPECT_EQ(counters.frames_missing, 1u);
  EXPECT_EQ(counters.bytes_written, 3u * 4096);  // three pictures, a block each
  EXPECT_EQ(counters.queued_bytes, 0u);
  EXPECT_EQ(counters.stop_cause, "");
  std::vector<std::string> drops;
  const auto take = RecordedTake::Open(temp / "take");
  ASSERT_TRUE(take.ok());
  for (const LedgerEntry& entry : (*take)->ledger())
    if (entry.event == LedgerEvent::kDropped && entry.cause.starts_with("late"))
      drops.push_back(std::to_string(entry.first_set) + " to " + std::to_string(entry.last_set) + " at " +
                      std::to_string(entry.device_time_ns) + " " + entry.cause);
  EXPECT_THAT(drops, ElementsAre("0 to 3 at 7 late", "4 to 4 at 9 later", "6 to 6 at 10 later"));
}

// A disk that takes no more: what it has is kept, the rest is told as dropped.
TEST(Recorder, StopsAtTheFirstWriteThatFails) {
  const TempFolder temp;
  PatternFrames cameras({"a", "b"}, 64, 40);
  RecorderOptions options = Small();
  options.take.stream.preallocate_bytes = 0;
  auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), options);
  ASSERT_TRUE(recorder.ok()) << recorder.status();
  uint64_t set = 0;
  while (set < 3) EXPECT_TRUE((*recorder)->Offer(cameras.Set(set++)));
  for (int i = 0; i < 30'000 && (*recorder)->Counters().sets_recorded < 3; ++i) usleep(1000);
  {
    const FileSizeLimit limit(200'000);
    while ((*recorder)->OfferAndWait(cameras.Set(set++)) && set < 100'000) {
    }
  }
  const RecorderCounters stopped = (*recorder)->Counters();
  EXPECT_THAT(stopped.stop_cause, HasSubstr(".stream"));
  const absl::Status status = (*recorder)->Stop();
  EXPECT_FALSE(status.ok());
  EXPECT_EQ(status.message(), stopped.stop_cause);
  const RecorderCounters counters = (*recorder)->Counters();
  EXPECT_EQ(counters.stop_cause, stopped.stop_cause);
  EXPECT_EQ(counters.sets_offered, set);
  EXPECT_GE(counters.sets_recorded, 3u) << "those that were acknowledged";
  EXPECT_GT(counters.sets_dropped, 0u);
  EXPECT_EQ(counters.sets_recorded + counters.sets_dropped, set);
  EXPECT_EQ(counters.queued_bytes, 0u);
  ExpectAccounted(temp / "take", cameras, set);
  const auto take = RecordedTake::Open(temp / "take");
  ASSERT_TRUE(take.ok()) << take.status();
  ASSERT_TRUE((*take)->stream(0).end());
  EXPECT_EQ((*take)->stream(0).end()->outcome, TakeOutcome::kStopped);
  EXPECT_EQ((*take)->stream(0).end()->sets_recorded, counters.sets_recorded);
  EXPECT_EQ((*take)->stream(0).end()->sets_dropped, counters.sets_dropped);
  size_t notes = 0;
  for (const LedgerEntry& entry : (*take)->ledger()) {
    notes += entry.event == LedgerEvent::kNote && entry.cause == "recording stopped: " + stopped.stop_cause;
    if (entry.event == LedgerEvent::kDropped) {
      EXPECT_EQ(entry.cause, "recording stopped: " + stopped.stop_cause);
    }
  }
  EXPECT_EQ(notes, 1u);
}

TEST(Recorder, AtTheLowDiskMarkSaysHowMuchIsFree) {
  const TempFolder temp;
  PatternFrames cameras({"a"}, 64, 40);
  RecorderOptions options = Small();
  options.low_disk_bytes = uint64_t{1} << 60;
  auto recorder = Recorder::Start(temp / "take", cameras.camera_ids(), options);
  ASSERT_TRUE(recorder.ok()) << recorder.status();
  for (int i = 0; i < 10'000 && (*recorder)->Counters().stop_cause.empty(); ++i) usleep(1000);
  EXPECT_EQ((*recorder)->Counters().room_bytes, 0u);
  EXPECT_FALSE((*recorder)->OfferAndWait(cameras.Set(0)));
  ASSERT_TRUE((*recorder)->Stop().ok());
  const std::string cause = (*recorder)->Counters().stop_cause;
  EXPECT_THAT(cause, HasSubstr(" MiB are free, the mark is 1099511627776 MiB"));
  const auto take = RecordedTake::Open(temp / "take");
  ASSERT_TRUE(take.ok()) << take.status();
  std::vector<std::string> causes;
  for (const LedgerEntry& entry : (*take)->ledger())
    if (!entry.cause.empty() && entry.event != LedgerEvent::kEnd) causes.push_back(entry.cause);
  EXPECT_THAT(causes, ::testing::Each("recording stopped: " + cause));
  EXPECT_GE(causes.size(), 2u) << "the note, and the set that was dropped";
}

}  // namespace
}  // namespace weft
