#include "services/results/evaluation/evaluation_verdict.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(EvaluationVerdict, TheHeadlineLeavesOutTheCoverageOfDrivenJobs) {
  JobEvaluation evaluation;
  evaluation.frames.resize(1);
  EXPECT_EQ(EvaluationHeadline(evaluation), "1 frame");
  evaluation.frames.resize(5);
  evaluation.total_metrics.coverage = 0.987;
  EXPECT_EQ(EvaluationHeadline(evaluation), "5 frames, 98.7 % of the cells seen by 3 cameras or more");
  evaluation.is_driven = true;
  EXPECT_EQ(EvaluationHeadline(evaluation), "5 frames");
}

}  // namespace
}  // namespace weft
