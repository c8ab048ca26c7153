#include "services/results/evaluation/comparison_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/results/evaluation/sample_comparison.h"

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
  EXPECT_EQ(ProbabilityText(0.001), "0.001");
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

TEST(ComparisonText, TheTableHasEveryNumberAndRemark) {
  EXPECT_EQ(ComparisonTable(SampleComparison()),
            R"(2 frames: A is better in 1 measure, B in none; no measure shows no significant difference

A        /a
B        /b
truth    /take/truth
differs  preset: A paper, B -
differs  starts: A -, B zero

mean over the frames                           |         A         B |     A - B std. err. | frames       p  p, all |
Coverage, 3 cameras or more, %                 |      75.0      25.0 |    +50.00      6.25 |      9   0.013   0.025 | A is better
Jitter, observed, mm                           |     1.500     2.000 |   -0.5000         - |      3       -       - | not tested
p: probability of such a difference by chance; p, all: for all measures together, significant below 0.05

meshes   vertices are 1.001 mm apart in the mean, 1.002 mm in the median, 1.003 mm at 95 %, 1.004 mm at most
         37.5 % of them farther than the sigmas of both explain (99 %)
note     frames: 1 frame was left out
note     A, jitter: of a
note     B, drift: of b
)");
}

}  // namespace
}  // namespace weft
