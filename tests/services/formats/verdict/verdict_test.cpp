#include "services/formats/verdict/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr Limit kShare{"test.share", "share of sets", "%", 99, 90, Better::kMore, 1, "Record again."};
constexpr Limit kError{"test.error", "error", "px", .2, .5, Better::kLess, 2, "Calibrate again."};

v1::Grade GradeOf(const Limit& limit, double value) {
  v1::Verdict verdict;
  AddCheck(verdict, limit, value);
  return verdict.grade();
}

TEST(Verdict, GradesAtAndBesideTheLimits) {
  EXPECT_EQ(GradeOf(kShare, 99), v1::GRADE_GOOD);
  EXPECT_EQ(GradeOf(kShare, 98.999), v1::GRADE_USABLE);
  EXPECT_EQ(GradeOf(kShare, 90), v1::GRADE_USABLE);
  EXPECT_EQ(GradeOf(kShare, 89.999), v1::GRADE_BAD);
  EXPECT_EQ(GradeOf(kError, .2), v1::GRADE_GOOD);
  EXPECT_EQ(GradeOf(kError, .5), v1::GRADE_USABLE);
  EXPECT_EQ(GradeOf(kError, .501), v1::GRADE_BAD);
  EXPECT_EQ(GradeOf(kError, std::nan("")), v1::GRADE_BAD);
}

TEST(Verdict, KeepsTheWorstGradeWithItsFirstReason) {
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_GOOD, "all is there", "");
  AddCheck(verdict, kShare, 95);
  AddCheck(verdict, kError, .7, "camera c03 moved");
  AddFinding(verdict, v1::GRADE_BAD, "a later one", "another remedy");
  EXPECT_EQ(verdict.grade(), v1::GRADE_BAD);
  EXPECT_EQ(verdict.reason(), "camera c03 moved");
  EXPECT_EQ(verdict.remedy(), "Calibrate again.");
  EXPECT_EQ(verdict.checks_size(), 2);
}

TEST(Verdict, TellsAllReasonsTheWorstFirst) {
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_GOOD, "all is well", "");
  AddFinding(verdict, v1::GRADE_USABLE, "a camera moved", "put it back");
  AddFinding(verdict, v1::GRADE_GOOD, "the sun shines", "");
  AddFinding(verdict, v1::GRADE_BAD, "no cell was seen", "take the cap off");
  AddFinding(verdict, v1::GRADE_USABLE, "a camera is late", "");
  AddCheck(verdict, kRegisterCoverage, 1);  // its value says it all
  AddCheck(verdict, kRegisterFrames, 10, "9 of 10 frames have no image");
  EXPECT_EQ(verdict.reason(), "no cell was seen");
  ASSERT_EQ(verdict.others_size(), 3);
  EXPECT_EQ(verdict.others(0).reason(), "9 of 10 frames have no image");
  EXPECT_EQ(verdict.others(1).reason(), "a camera moved");
  EXPECT_EQ(verdict.others(1).remedy(), "put it back");
  EXPECT_EQ(verdict.others(2).reason(), "a camera is late");
  EXPECT_THAT(VerdictText(verdict),
              ::testing::HasSubstr("  usable: a camera moved\n  usable: a camera is late\n"));
}

TEST(Verdict, PrintsTheValueBesideItsLimits) {
  v1::Verdict verdict;
  AddCheck(verdict, kError, .1);
  AddCheck(verdict, kShare, 40.24);
  EXPECT_EQ(VerdictText(verdict),
            "bad: share of sets: 40.2 % (good from 99 %, usable from 90 %)\n"
            "  remedy: Record again.\n");
  AddCheck(verdict, kError, .7);
  EXPECT_THAT(VerdictText(verdict),
              HasSubstr("\n  bad: error: 0.70 px (good up to 0.2 px, usable up to 0.5 px)\n"));
  EXPECT_THAT(VerdictText(v1::Verdict()), StartsWith("unknown"));
}

TEST(Verdict, ValueIsNotRoundedOverALimitThatItMisses) {
  v1::Verdict verdict;
  AddCheck(verdict, kShare, 98.99);
  AddCheck(verdict, kShare, 99.04);
  AddCheck(verdict, kError, 0.5004);
  EXPECT_EQ(verdict.checks(0).value(), "98.99 %");
  EXPECT_EQ(verdict.checks(1).value(), "99.0 %");
  EXPECT_EQ(verdict.checks(2).value(), "0.5004 px");
}

TEST(Verdict, GoodHasNoRemedy) {
  v1::Verdict verdict;
  AddCheck(verdict, kShare, 100);
  EXPECT_THAT(VerdictText(verdict), Not(HasSubstr("remedy")));
}

TEST(Verdict, OnlyBadEndsACommandWithAFailure) {
  v1::Verdict verdict;
  AddCheck(verdict, kShare, 95);
  EXPECT_TRUE(VerdictStatus(verdict).ok());
  AddCheck(verdict, kShare, 5);
  EXPECT_EQ(VerdictStatus(verdict).code(), absl::StatusCode::kAborted);
  EXPECT_TRUE(IsVerdict(VerdictStatus(verdict)));
  EXPECT_FALSE(IsVerdict(absl::AbortedError("something else")));
}

// docs/verdicts.md is what users read: `| id | name | good | usable |`, a row per limit, in the order of the
// header.
TEST(Verdict, DocumentHasEveryLimit) {
  std::ifstream file(WEFT_SOURCE_DIR "/docs/verdicts.md");
  ASSERT_TRUE(file);
  std::vector<std::string> documented;
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("| `")) documented.push_back(line);
  ASSERT_EQ(documented.size(), kLimits.size());
  for (size_t k = 0; k < kLimits.size(); ++k) {
    const Limit& limit = *kLimits[k];
    EXPECT_THAT(documented[k], StartsWith(absl::StrCat("| `", limit.id, "` | ", limit.name, " | ",
                                                       LimitsText(limit), " | ")));
  }
}

TEST(Verdict, LimitsHaveIdsOfTheirOwnAndARightOrder) {
  std::set<absl::string_view> ids;
  for (const Limit* limit : kLimits) {
    EXPECT_TRUE(ids.insert(limit->id).second) << limit->id;
    EXPECT_FALSE(limit->remedy.empty()) << limit->id;
    const double step =
        limit->better == Better::kMore ? limit->good - limit->usable : limit->usable - limit->good;
    EXPECT_GE(step, 0) << limit->id;
  }
}

}  // namespace
}  // namespace weft
