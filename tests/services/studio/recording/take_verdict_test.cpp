#include "services/studio/recording/take_verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace weft
