// Each check of an evaluation has a case in which it alone fails, and the verdict is not good.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/verdict/limits.h"
#include "services/results/evaluation/evaluation_verdict.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Twenty frames that have all measures, and all of them good.
JobEvaluation Measured() {
  JobEvaluation evaluation;
  evaluation.frames.resize(20);
  FrameMetrics& total = evaluation.total_metrics;
  total.coverage = 0.9;
  total.true_drift_observed_mm_s = ErrorSummary{.count = 100, .mean = 1};
  total.distortion_relative = 0.01;
  total.self_intersections = 0;
  total.left_out_px = ErrorSummary{.count = 100, .mean = 0.2};
  evaluation.total.centers = DecodeScore{.observations = 1000, .right = 999};
  evaluation.total.mesh.emplace().visible_mm.push_back(0.1);
  return evaluation;
}

std::vector<std::string> Failing(const JobEvaluation& evaluation) {
  std::vector<std::string> ids;
  const v1::Verdict verdict = VerdictOf(evaluation);
  for (const v1::VerdictCheck& check : verdict.checks())
    if (check.grade() != v1::GRADE_GOOD) ids.push_back(check.id());
  EXPECT_EQ(ids.empty(), verdict.grade() == v1::GRADE_GOOD) << verdict.reason();
  return ids;
}

TEST(EvaluationChecksAlone, EachFailsAlone) {
  const std::map<std::string, std::function<void(JobEvaluation&)>> cases = {
      {"evaluate.frames", [](auto& e) { e.frames[0].missing.push_back(FileName(FrameFile::kMesh)); }},
      {"evaluate.coverage", [](auto& e) { e.total_metrics.coverage = 0.6; }},
      {"evaluate.precision", [](auto& e) { e.total.centers->right = 990; }},
      {"evaluate.vertex_error", [](auto& e) { e.total.mesh->visible_mm.push_back(2); }},
      {"evaluate.drift", [](auto& e) { e.total_metrics.true_drift_observed_mm_s->mean = 8; }},
      {"evaluate.distortion", [](auto& e) { e.total_metrics.distortion_relative = 0.05; }},
      {"evaluate.self_intersections", [](auto& e) { e.total_metrics.self_intersections = 100; }},
      {"evaluate.left_out", [](auto& e) { e.total_metrics.left_out_px->mean = 0.9; }},
  };
  EXPECT_THAT(Failing(Measured()), IsEmpty());
  for (const auto& [id, change] : cases) {
    JobEvaluation evaluation = Measured();
    change(evaluation);
    EXPECT_THAT(Failing(evaluation), ElementsAre(id));
  }
  for (const Limit* limit : kLimits) {
    const std::string id(limit->id);
    EXPECT_EQ(cases.contains(id), absl::StartsWith(id, "evaluate.")) << id;
  }
}

}  // namespace
}  // namespace weft
