#include <gtest/gtest.h>

#include "services/formats/files/json_file.h"
#include "services/results/evaluation/comparison_text.h"
#include "tests/services/results/evaluation/sample_comparison.h"
#include "tests/services/results/report/proto_text.h"

namespace weft {
namespace {

TEST(ComparisonJson, EveryFieldIsThatOfTheComparison) {
  const v1::Comparison message = ComparisonMessage(SampleComparison());
  EXPECT_EQ(
      message.DebugString(),
      TextOf<v1::Comparison>(
          R"(a: "/a" b: "/b" measures { measure: "coverage" title: "Coverage, 3 cameras or more" unit: "%" frames: 9
a: 0.75 b: 0.25 difference: 0.5 standard_error: 0.0625 degrees_of_freedom: 6 p: 0.0125 p_adjusted: 0.025
outcome: COMPARISON_OUTCOME_A_BETTER } measures { measure: "jitter_observed_mm" title: "Jitter, observed"
unit: "mm" frames: 3 a: 1.5 b: 2 difference: -0.5 outcome: COMPARISON_OUTCOME_NOT_TESTED } meshes {
distance_mm { count: 60 mean: 1.001 median: 1.002 p95: 1.003 max: 1.004 p99: 1.005 } beyond_sigmas_share:
0.375 } frames { frame: "0001" meshes { distance_mm { count: 30 mean: 0.501 median: 0.502 p95: 0.503 max:
0.504 p99: 0.505 } beyond_sigmas_share: 0.125 } } frames { frame: "0002" meshes { } } differences { what:
"preset" a: "paper" } differences { what: "starts" b: "zero" } remarks { measure: "frames" reason:
"1 frame was left out" } remarks { measure: "A: jitter" reason: "of a" } remarks { measure: "B: drift"
reason: "of b" } significance_level: 0.05 truth: "/take/truth" frames_per_s: 25)"));
  v1::Comparison read;
  ASSERT_TRUE(ParseJson(*ToJson(ComparisonMessage(SampleComparison())), "json", read).ok());
  EXPECT_EQ(read.DebugString(), message.DebugString());
}

TEST(ComparisonJson, OutcomesHaveNames) {
  using enum ComparisonOutcome;
  struct Case {
    ComparisonOutcome outcome;
    v1::ComparisonOutcome message;
    const char* text;
  };
  for (const auto& [outcome, message, text] :
       {Case{kNotTested, v1::COMPARISON_OUTCOME_NOT_TESTED, "not tested"},
        {kNoDifference, v1::COMPARISON_OUTCOME_NO_DIFFERENCE, "no significant difference"},
        {kABetter, v1::COMPARISON_OUTCOME_A_BETTER, "A is better"},
        {kBBetter, v1::COMPARISON_OUTCOME_B_BETTER, "B is better"},
        {kALower, v1::COMPARISON_OUTCOME_A_LOWER, "A is lower"},
        {kAHigher, v1::COMPARISON_OUTCOME_A_HIGHER, "A is higher"}}) {
    JobComparison comparison = SampleComparison();
    comparison.measures[0].outcome = outcome;
    EXPECT_EQ(ComparisonMessage(comparison).measures(0).outcome(), message);
    EXPECT_EQ(OutcomeText(outcome), text);
  }
}

}  // namespace
}  // namespace weft
