#include "services/studio/recording/take_recovery.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "capture/take/take_files.h"
#include "capture/take/take_writer.h"
#include "services/formats/files/json_file.h"
#include "services/studio/recording/clock_log.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A take as a recorder leaves it, with a log of the clocks.
class TakeRecoveryTest : public ::testing::Test {
 protected:
  TakeRecoveryTest() {
    RecordPattern(take_, cameras_);
    ClockLog clocks(cameras_.camera_ids());
    EXPECT_TRUE(clocks.Open(take_).ok());
    clocks.Add(0, {1000, -5, 3, "", {}});
    clocks.Add(1, {2000, -6, 3, "", {}});
    EXPECT_TRUE(clocks.Close().ok());
    v1::Take take = Take();
    for (const std::string& id : cameras_.camera_ids()) take.add_cameras()->set_id(id);
    take.set_state(v1::TAKE_STATE_COMPLETE);
    take.set_sets_recorded(4);
    take.set_frames_missing(1);
    take.set_clocks_checksum(clocks.end_checksum());
    Put(take);
  }
  v1::Take Take() const { return ReadTakeFile(take_).value_or(v1::Take()); }
  void Put(const v1::Take& take) const { EXPECT_TRUE(WriteTakeFile(take_, take).ok()); }
  v1::TakeCheckReport Check() const {
    const auto report = VerifyRecordedTake(take_);
    EXPECT_TRUE(report.ok()) << report.status();
    return report.value_or(v1::TakeCheckReport());
  }
  v1::TakeRecoveryReport Recover(const TakeRecoveryChoice& choice) const {
    const auto report = RecoverRecordedTake(take_, choice);
    EXPECT_TRUE(report.ok()) << report.status();
    return report.value_or(v1::TakeRecoveryReport());
  }
  std::string Stream(const std::string& id) const { return StreamFile(StreamFolder(take_), id); }
  void Cut(const std::string& file, uintmax_t bytes) const {
    fs::resize_file(file, fs::file_size(file) - bytes);
  }
  // As a recorder that was killed leaves it.
  void Open() const {
    v1::Take take = Take();
    take.set_state(v1::TAKE_STATE_RECORDING);
    take.clear_sets_recorded();
    take.clear_frames_missing();
    Put(take);
  }

  const TempFolder folder_;
  const std::string take_ = folder_ / "take";
  PatternFrames cameras_{{"left", "right"}, 64, 48};
};

TEST_F(TakeRecoveryTest, AWholeTakeIsWhole) {
  const v1::TakeCheckReport report = Check();
  EXPECT_THAT(report.problems(), IsEmpty());
  EXPECT_THAT(report.warnings(), IsEmpty());
  EXPECT_TRUE(report.whole());
  EXPECT_EQ(report.take(), take_);
  EXPECT_EQ(report.sets(), 4u);
  EXPECT_EQ(report.complete_sets(), 3u);
  EXPECT_EQ(report.frames(), 7u);
  EXPECT_EQ(report.missing(), 1u);
  EXPECT_EQ(report.dropped(), 0u);
  EXPECT_EQ(report.unindexed(), 0u);
  EXPECT_EQ(report.bytes(), fs::file_size(Stream("left")) + fs::file_size(Stream("right")));
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_USABLE);
}

TEST_F(TakeRecoveryTest, TotalsAreComparedWithWhatTheTakeHas) {
  v1::Take take = Take();
  take.set_sets_recorded(5);
  take.set_sets_dropped(2);
  take.set_frames_missing(3);
  Put(take);
  EXPECT_THAT(Check().problems(), ElementsAre("take.json: says 5 frame sets recorded, the take has 4",
                                              "take.json: says 2 frame sets dropped, the take has 0",
                                              "take.json: says 3 frames missing, the take has 1"));
  EXPECT_FALSE(Check().whole());
}

TEST_F(TakeRecoveryTest, TheFileIsComparedWithTheStreams) {
  v1::Take take = Take();
  take.mutable_cameras()->RemoveLast();
  Put(take);
  EXPECT_THAT(Check().problems(), ElementsAre("camera right: has a stream, and take.json does not name it"));
  take.set_id("00000000000000ff");
  Put(take);
  EXPECT_THAT(Check().problems(),
              Contains("take.json: is of take 00000000000000ff, the streams are of another"));
}

TEST_F(TakeRecoveryTest, AFileWithoutChecksumIsAProblemBesideStreamsThatHaveOne) {
  WriteBytes(TakeJsonFile(take_), ToJson(Take(), JsonZeros::kOmitted).value());
  EXPECT_THAT(Check().problems(),
              ElementsAre("take.json: has no checksum, though its streams are of a version that has one"));
}

TEST_F(TakeRecoveryTest, ATakeThatWasNotClosedIsAProblem) {
  Open();
  EXPECT_THAT(Check().problems(),
              ElementsAre("take.json: the take was not closed: its recorder ended in the middle"));
  EXPECT_THAT(Check().verdict().remedy(), HasSubstr("weft take recover " + take_));
  const auto ledger = OpenLockedLedger(take_, O_RDWR);
  ASSERT_TRUE(ledger.ok()) << ledger.status();
  EXPECT_THAT(Check().problems(), ElementsAre("the take is being recorded"));
  EXPECT_TRUE(absl::IsFailedPrecondition(PurgeRecovered(take_).status()));
}

TEST_F(TakeRecoveryTest, DamageToTheFileOrTheClocksIsAProblem) {
  fs::remove(ClockLogFile(take_));
  EXPECT_THAT(Check().problems(), ElementsAre("clocks.csv: is missing"));
  WriteBytes(TakeJsonFile(take_), "{");
  EXPECT_THAT(Check().problems(), Contains(HasSubstr("damaged: ")));
  EXPECT_TRUE(absl::IsNotFound(VerifyRecordedTake(folder_ / "nothing").status()));
}

TEST_F(TakeRecoveryTest, AClosedTakeIsLeftAloneWithoutForce) {
  const absl::Status refused = RecoverRecordedTake(take_).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(refused));
  EXPECT_THAT(std::string(refused.message()),
              AllOf(HasSubstr("the take was closed"), HasSubstr("`weft take recover --force`")));
  const std::string before = ReadBytes(TakeJsonFile(take_));
  const v1::TakeRecoveryReport report = Recover({.force = true});
  EXPECT_THAT(report.changes(), IsEmpty());
  EXPECT_THAT(report.damage(), IsEmpty());
  EXPECT_EQ(report.kept_aside(), "");
  EXPECT_FALSE(report.dry_run());
  EXPECT_EQ(report.verdict().reason(), "nothing to do");
  EXPECT_EQ(ReadBytes(TakeJsonFile(take_)), before);
}

TEST_F(TakeRecoveryTest, ATakeThatWasNotClosedGetsItsTotals) {
  Open();
  const std::string before = ReadBytes(TakeJsonFile(take_));
  const v1::TakeRecoveryReport dry = Recover({.dry_run = true});
  EXPECT_TRUE(dry.dry_run());
  EXPECT_THAT(dry.changes(), Contains(HasSubstr("take.json: says that the take was recovered")));
  EXPECT_EQ(ReadBytes(TakeJsonFile(take_)), before);

  const v1::TakeRecoveryReport report = Recover({});
  EXPECT_EQ(report.take(), take_);
  EXPECT_EQ(report.sets(), 4u);
  EXPECT_EQ(report.frames_lost(), 0u);
  EXPECT_THAT(report.changes(), Contains(HasSubstr("take.json: says that the take was recovered")));
  const v1::Take take = Take();
  EXPECT_EQ(take.state(), v1::TAKE_STATE_RECOVERED);
  EXPECT_EQ(take.stop_cause(), "the recorder ended without closing the take");
  EXPECT_GT(take.ended_host_time_ns(), 0);
  EXPECT_EQ(take.sets_recorded(), 4u);
  EXPECT_EQ(take.frames_missing(), 1u);
  EXPECT_EQ(take.frames_lost(), 0u);
  EXPECT_THAT(Check().problems(), IsEmpty());
  EXPECT_TRUE(absl::IsFailedPrecondition(RecoverRecordedTake(take_).status())) << "it is closed now";
}

// Both streams lost their ends, though take.json says that the take was closed.
TEST_F(TakeRecoveryTest, StreamsThatAllLackTheirEndsAreOfATakeThatWasNotClosed) {
  Cut(Stream("left"), 4096);
  EXPECT_TRUE(absl::IsFailedPrecondition(RecoverRecordedTake(take_).status()));
  Cut(Stream("right"), 4096);
  EXPECT_TRUE(RecoverRecordedTake(take_).ok());
}

TEST_F(TakeRecoveryTest, FramesThatAreGoneAreCountedAndWhatIsCutIsKept) {
  fs::remove(Stream("left"));
  const v1::TakeRecoveryReport report = Recover({.force = true});
  EXPECT_EQ(report.frames_lost(), 4u);
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_USABLE);
  EXPECT_EQ(Take().frames_lost(), 4u);
  EXPECT_EQ(Take().frames_missing(), 5u);
  EXPECT_EQ(Take().state(), v1::TAKE_STATE_RECOVERED);
  EXPECT_EQ(Take().stop_cause(), "");  // it was closed
  ASSERT_NE(report.kept_aside(), "");
  v1::TakeRecoveryReport kept;
  ASSERT_TRUE(ReadJsonFile(report.kept_aside() + "/recovery.json", kept).ok());
  EXPECT_EQ(kept.frames_lost(), 4u);
  // Another loss is added to the first.
  WriteBytes(Stream("right"), "no stream");
  EXPECT_EQ(Recover({.force = true}).frames_lost(), 3u);
  EXPECT_EQ(Take().frames_lost(), 7u);
}

TEST_F(TakeRecoveryTest, WhatWasKeptAsideIsPurgedAndCounted) {
  EXPECT_EQ(PurgeRecovered(take_).value(), 0u);
  fs::create_directories(take_ + "/recovered/1/deep");
  WriteBytes(take_ + "/recovered/1/a", "12345");
  WriteBytes(take_ + "/recovered/1/deep/b", "123");
  EXPECT_EQ(PurgeRecovered(take_).value(), 8u);
  EXPECT_FALSE(fs::exists(take_ + "/recovered"));
  EXPECT_TRUE(fs::exists(Stream("left")));
  EXPECT_TRUE(absl::IsNotFound(PurgeRecovered(folder_ / "nothing").status()));
}

TEST_F(TakeRecoveryTest, ADamagedFileIsKeptAsideAndMadeAnew) {
  const std::string id = Take().id();
  WriteBytes(TakeJsonFile(take_), "{\"id\": ");
  const v1::TakeRecoveryReport report = Recover({.force = true});
  EXPECT_THAT(report.damage(), Contains(HasSubstr("take.json")));
  EXPECT_EQ(ReadBytes(report.kept_aside() + "/take.json"), "{\"id\": ");
  EXPECT_EQ(Take().id(), id);
  EXPECT_EQ(Take().state(), v1::TAKE_STATE_RECOVERED);
  EXPECT_EQ(Take().sets_recorded(), 4u);
}

TEST_F(TakeRecoveryTest, ClocksThatAreLostBecomeAnEmptyLog) {
  fs::remove(ClockLogFile(take_));
  const v1::TakeRecoveryReport dry = Recover({.force = true, .dry_run = true});
  EXPECT_THAT(dry.damage(), ElementsAre("clocks.csv: is missing"));
  EXPECT_FALSE(fs::exists(ClockLogFile(take_)));
  const v1::TakeRecoveryReport report = Recover({.force = true});
  EXPECT_THAT(report.damage(), ElementsAre("clocks.csv: is missing"));
  EXPECT_THAT(report.changes(), ElementsAre("clocks.csv: has the readings that are whole"));
  EXPECT_EQ(ReadBytes(ClockLogFile(take_)), ClockLogText({}));
  EXPECT_EQ(Take().state(), v1::TAKE_STATE_COMPLETE);  // no frame of it changed
  EXPECT_THAT(Check().problems(), IsEmpty());
}

TEST_F(TakeRecoveryTest, ReadingsThatAreWholeStay) {
  const std::string text = ReadBytes(ClockLogFile(take_));
  std::string damaged = text;
  damaged[text.find("2000,right")] = '9';
  WriteBytes(ClockLogFile(take_), damaged);
  const v1::TakeRecoveryReport report = Recover({.force = true});
  EXPECT_THAT(report.damage(), ElementsAre("clocks.csv: line 3 is not as it was written, 1 in all"));
  EXPECT_EQ(ReadBytes(report.kept_aside() + "/clocks.csv"), damaged);
  const ParsedClockLog log = ParseClockLog(take_).value();
  EXPECT_TRUE(log.has_end);
  ASSERT_EQ(log.readings.size(), 1u);
  EXPECT_EQ(log.readings[0].camera_id, "left");
  EXPECT_EQ(Take().clocks_checksum(), log.end_checksum);
  EXPECT_THAT(Check().problems(), IsEmpty());
}

// The last line of a recorder that was killed is no damage.
TEST_F(TakeRecoveryTest, ALogThatACrashCutGetsItsEndWithoutDamage) {
  Open();
  v1::Take take = Take();
  take.clear_clocks_checksum();
  Put(take);
  const std::string text = ReadBytes(ClockLogFile(take_));
  WriteBytes(ClockLogFile(take_), text.substr(0, text.find("2000,right") + 7));
  const v1::TakeRecoveryReport report = Recover({});
  EXPECT_THAT(report.damage(), IsEmpty());
  const ParsedClockLog log = ParseClockLog(take_).value();
  EXPECT_TRUE(log.has_end);
  EXPECT_EQ(log.readings.size(), 1u);
  EXPECT_EQ(log.damaged_lines, 0u);
  EXPECT_EQ(Take().clocks_checksum(), log.end_checksum);
}

}  // namespace
}  // namespace weft
