#include "services/results/evaluation/comparison_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

JobComparison WithOutcomes(const std::vector<ComparisonOutcome>& outcomes) {
  JobComparison comparison;
  comparison.a.frames.resize(12);
  for (const ComparisonOutcome outcome : outcomes) {
    ComparedMeasure& compared = comparison.measures.emplace_back();
    compared.measure = &EvaluationMeasures().front();
    compared.outcome = outcome;
  }
  return comparison;
}

TEST(ComparisonText, TheHeadlineCountsOutcomes) {
  using enum ComparisonOutcome;
  EXPECT_EQ(ComparisonHeadline(WithOutcomes({kABetter, kABetter, kNoDifference, kALower})),
            "12 frames: A is better in 2 measures, B in none; 1 shows no significant difference");
  EXPECT_EQ(ComparisonHeadline(WithOutcomes({kBBetter})),
            "12 frames: A is better in none, B in 1 measure; no measure shows no significant difference");
  EXPECT_EQ(ComparisonHeadline(WithOutcomes({kNotTested})), "12 frames, too few to test differences");
}

TEST(ComparisonText, SmallProbabilitiesAreABound) {
  EXPECT_EQ(ProbabilityText(0.0009), "< 0.001");
  EXPECT_EQ(ProbabilityText(0.042), "0.042");
}

TEST(ComparisonText, TheTableNamesWhatTheJobsDifferIn) {
  JobComparison comparison = WithOutcomes({});
  comparison.a.result = "/a";
  comparison.differences = {{"preset", "paper", ""}};
  const std::string table = ComparisonTable(comparison);
  EXPECT_THAT(table, HasSubstr("\nA        /a\n"));
  EXPECT_THAT(table, HasSubstr("differs  preset: A paper, B -\n"));
}

}  // namespace
}  // namespace weft
