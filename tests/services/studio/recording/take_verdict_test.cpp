#include "services/studio/recording/take_verdict.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "capture/take/take_files.h"
#include "capture/take/take_writer.h"
#include "services/studio/recording/take_description.h"
#include "services/studio/recording/take_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(TakeVerdict, OfACheckIsThatOfItsWorstFinding) {
  v1::TakeCheckReport report;
  AssessCheck(report, true);
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_GOOD);

  v1::TakeCheckReport with_gaps;
  with_gaps.set_take("/t");
  with_gaps.set_missing(3);
  AssessCheck(with_gaps, true);
  EXPECT_EQ(with_gaps.verdict().grade(), v1::GRADE_USABLE);
  EXPECT_EQ(with_gaps.verdict().reason(), "whole, and 3 frames are missing, each with its reason");
  EXPECT_EQ(with_gaps.verdict().remedy(), "`weft take info /t` shows the reasons");

  v1::TakeCheckReport damaged = with_gaps;
  damaged.clear_verdict();
  damaged.add_warnings("a bit beside the frames");
  damaged.add_problems("c01: checksum");
  damaged.add_problems("c02: cut");
  AssessCheck(damaged, true);
  EXPECT_EQ(damaged.verdict().grade(), v1::GRADE_BAD);
  EXPECT_EQ(damaged.verdict().reason(), "c01: checksum (and 1 more)");
  EXPECT_THAT(damaged.verdict().remedy(), HasSubstr("`weft take recover --force /t`"));
}

// A take that is closed is changed only by those who insist.
TEST(TakeVerdict, RecoversAnOpenTakeWithoutForce) {
  EXPECT_THAT(RecoverRemedy("/t", false), HasSubstr("`weft take recover /t`"));
  EXPECT_THAT(RecoverRemedy("/t", true), HasSubstr("`weft take recover --force /t`"));
}

TEST(TakeVerdict, OfARecoveryTellsWhatIsGone) {
  v1::TakeRecoveryReport nothing;
  AssessRecovery(nothing);
  EXPECT_EQ(nothing.verdict().grade(), v1::GRADE_GOOD);
  EXPECT_EQ(nothing.verdict().reason(), "nothing to do");

  v1::TakeRecoveryReport lost;
  lost.set_frames_lost(2);
  lost.set_dry_run(true);
  AssessRecovery(lost);
  EXPECT_EQ(lost.verdict().grade(), v1::GRADE_USABLE);
  EXPECT_EQ(lost.verdict().reason(),
            "2 recorded frames are gone; gaps with their reason would take their places");

  v1::TakeRecoveryReport whole;
  whole.add_damage("c01: byte 7");
  AssessRecovery(whole);
  EXPECT_EQ(whole.verdict().reason(), "damage, with no frame lost: c01: byte 7");
}

TEST(TakeVerdict, OfACheckWithWarningsIsUsable) {
  v1::TakeCheckReport report;
  report.set_take("/t");
  report.set_missing(3);
  report.add_warnings("c01.stream: byte 7 beside the frames");
  AssessCheck(report, true);
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_USABLE);
  EXPECT_EQ(report.verdict().reason(), "c01.stream: byte 7 beside the frames");
  EXPECT_THAT(report.verdict().remedy(), HasSubstr("the take can be used as it is"));
  v1::TakeCheckReport one;
  one.set_take("/t");
  one.add_problems("c01: checksum");
  AssessCheck(one, false);
  EXPECT_EQ(one.verdict().reason(), "c01: checksum");
  EXPECT_THAT(one.verdict().remedy(), HasSubstr("`weft take recover /t`"));
}

TEST(TakeVerdict, OfARecoveryThatChangedSomethingSaysSo) {
  v1::TakeRecoveryReport lost;
  lost.set_frames_lost(2);
  AssessRecovery(lost);
  EXPECT_THAT(lost.verdict().reason(), HasSubstr("gaps with their reason take their places"));
  v1::TakeRecoveryReport changed;
  changed.add_changes("c01: index");
  AssessRecovery(changed);
  EXPECT_EQ(changed.verdict().grade(), v1::GRADE_GOOD);
  EXPECT_EQ(changed.verdict().reason(), "every frame that was acknowledged is there");
}

// Four sets of one camera, all complete.
class AssessTakeTest : public ::testing::Test {
 protected:
  AssessTakeTest() {
    PatternFrames cameras({"left", "right"}, 64, 48);
    std::vector<RawFrameSet> sets;
    for (uint64_t number = 0; number < 4; ++number) sets.push_back(cameras.Set(number));
    RecordSets(take_, cameras.camera_ids(), sets);
    Change([](v1::Take& take) {
      take.set_state(v1::TAKE_STATE_COMPLETE);
      for (const char* id : {"left", "right"}) take.add_cameras()->set_id(id);
    });
  }
  void Change(const std::function<void(v1::Take&)>& change) {
    v1::Take take = ReadTakeFile(take_).value_or(v1::Take());
    change(take);
    EXPECT_TRUE(WriteTakeFile(take_, take).ok());
  }
  v1::Verdict Verdict() const {
    const auto info = DescribeTake(take_);
    EXPECT_TRUE(info.ok()) << info.status();
    return info.ok() ? info->verdict() : v1::Verdict();
  }
  std::string Stream(const std::string& id) const { return StreamFile(StreamFolder(take_), id); }

  const TempFolder folder_;
  const std::string take_ = folder_ / "take";
};

TEST_F(AssessTakeTest, AWholeTakeIsGood) {
  EXPECT_EQ(Verdict().grade(), v1::GRADE_GOOD);
  EXPECT_EQ(Verdict().reason(), "all 4 frame sets have all cameras");
  const auto info = DescribeTake(take_);
  EXPECT_EQ(info->sets_complete(), 4u);
  EXPECT_EQ(info->sets_dropped(), 0u);
  EXPECT_FALSE(IsBeingRecorded(take_));
}

TEST_F(AssessTakeTest, OneThatIsNotClosedIsBeingRecordedOrBroken) {
  Change([](v1::Take& take) { take.set_state(v1::TAKE_STATE_RECORDING); });
  EXPECT_EQ(Verdict().grade(), v1::GRADE_BAD);
  EXPECT_EQ(Verdict().reason(), "the take was not closed: its recorder ended in the middle");
  EXPECT_EQ(Verdict().remedy(),
            "run `weft take recover " + take_ + "`; with --dry-run it only says what it would do");
  const auto ledger = OpenLockedLedger(take_, O_RDWR);
  ASSERT_TRUE(ledger.ok()) << ledger.status();
  EXPECT_TRUE(IsBeingRecorded(take_));
  EXPECT_EQ(Verdict().grade(), v1::GRADE_USABLE);
  EXPECT_EQ(Verdict().reason(), "the take is being recorded");
  EXPECT_EQ(Verdict().remedy(), "wait for its end");
  const absl::Status described = DescribeTakeFile(take_, {.slate = "12A", .name = {}, .notes = {}}).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(described));
  EXPECT_EQ(described.message(), take_ + ": is being recorded; describe it when it has ended");
}

TEST_F(AssessTakeTest, OneThatStoppedOrLostFramesIsUsable) {
  Change([](v1::Take& take) { take.set_state(v1::TAKE_STATE_STOPPED); });
  EXPECT_EQ(Verdict().grade(), v1::GRADE_USABLE);
  EXPECT_EQ(Verdict().reason(), "the recording stopped early");
  Change([](v1::Take& take) { take.set_stop_cause("disk nearly full"); });
  EXPECT_EQ(Verdict().reason(), "the recording stopped early: disk nearly full");
  Change([](v1::Take& take) {
    take.set_state(v1::TAKE_STATE_RECOVERED);
    take.set_frames_lost(7);
  });
  EXPECT_EQ(Verdict().grade(), v1::GRADE_USABLE);
  EXPECT_EQ(Verdict().reason(), "7 frames were lost to damage and replaced by gaps");
}

TEST_F(AssessTakeTest, StreamsThatAreGoneOrCutAreNamed) {
  Change([](v1::Take& take) { take.add_cameras()->set_id("top"); });
  EXPECT_EQ(Verdict().grade(), v1::GRADE_BAD);
  EXPECT_EQ(Verdict().reason(), "camera top: its stream is gone");
  EXPECT_THAT(Verdict().remedy(), HasSubstr("replace it by gaps: run `weft take recover --force " + take_));
  Change([](v1::Take& take) { take.mutable_cameras()->RemoveLast(); });
  std::filesystem::resize_file(Stream("right"), std::filesystem::file_size(Stream("right")) - 1);
  EXPECT_EQ(Verdict().grade(), v1::GRADE_BAD);
  EXPECT_EQ(Verdict().reason(), "camera right: its stream was cut");
  // Neither stream has an end: the disk took none.
  std::filesystem::resize_file(Stream("left"), std::filesystem::file_size(Stream("left")) - 1);
  Change([](v1::Take& take) {
    take.set_state(v1::TAKE_STATE_STOPPED);
    take.set_stop_cause("no room");
  });
  const v1::Verdict full = Verdict();
  EXPECT_EQ(full.grade(), v1::GRADE_BAD);
  EXPECT_EQ(full.reason(),
            "the recording stopped early: no room; the disk did not take the end of the streams either");
  EXPECT_THAT(full.remedy(), HasSubstr("make room, and run `weft take recover " + take_));
}

}  // namespace
}  // namespace weft
