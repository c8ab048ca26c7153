#include "services/results/evaluation/evaluation_verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/verdict/verdict.h"
#include "tests/services/results/evaluation/sample_evaluation.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(EvaluationVerdict, TheHeadlineLeavesOutTheCoverageOfDrivenJobs) {
  JobEvaluation evaluation;
  evaluation.frames.resize(1);
  EXPECT_EQ(EvaluationHeadline(evaluation), "1 frame");
  evaluation.frames.resize(5);
  evaluation.total_metrics.coverage = 0.987;
  EXPECT_EQ(EvaluationHeadline(evaluation), "5 frames, 98.7 % of the cells seen by 3 cameras or more");
  evaluation.is_driven = true;
  EXPECT_EQ(EvaluationHeadline(evaluation), "5 frames");
  AddErrors({0.5, 1}, evaluation.total.mesh.emplace().visible_mm);
  EXPECT_EQ(EvaluationHeadline(evaluation), "5 frames, vertex error 0.750 mm");
}

// "ID VALUE" of each check.
std::vector<std::string> ChecksOf(const JobEvaluation& evaluation) {
  std::vector<std::string> lines;
  const v1::Verdict verdict = VerdictOf(evaluation);
  for (const v1::VerdictCheck& check : verdict.checks()) lines.push_back(check.id() + " " + check.value());
  return lines;
}

TEST(EvaluationVerdict, ChecksAreOfTheNumbersOfTheEvaluation) {
  JobEvaluation evaluation = SampleEvaluation();
  EXPECT_EQ(VerdictText(VerdictOf(evaluation)), R"(bad: 1 of 2 frames that were asked for have no mesh
  remedy: See in the report of the job why the others have none, fix that, and register them again.
  bad: frames with a mesh: 50.0 % (good from 100 %, usable from 90 %)
  usable: decoded cells that are right: 99.00 % (good from 99.5 %, usable from 98 %)
  bad: vertex error where 3 cameras or more see, mean: 4.000 mm (good up to 0.5 mm, usable up to 1.5 mm)
  usable: drift of observed vertices, mean: 5.00 mm/s (good up to 3 mm/s, usable up to 15 mm/s)
  bad: pairs of faces that intersect, a frame: 1234.0 (good up to 0, usable up to 20)
  bad: error of a camera that is left out, mean: 15.001 px (good up to 0.5 px, usable up to 1.5 px)
)");
  EXPECT_THAT(
      ChecksOf(evaluation),
      ElementsAre("evaluate.frames 50.0 %", "evaluate.coverage 81.2 %", "evaluate.precision 99.00 %",
                  "evaluate.vertex_error 4.000 mm", "evaluate.drift 5.00 mm/s", "evaluate.distortion 1.50 %",
                  "evaluate.self_intersections 1234.0", "evaluate.left_out 15.001 px"));
  // Drift by pictures where there is no truth, and no share of cells where a job is driven.
  evaluation.total_metrics.true_drift_observed_mm_s.reset();
  evaluation.is_driven = true;
  evaluation.total = {};
  EXPECT_THAT(ChecksOf(evaluation),
              ElementsAre("evaluate.frames 50.0 %", "evaluate.drift 2.00 mm/s", "evaluate.distortion 1.50 %",
                          "evaluate.self_intersections 1234.0", "evaluate.left_out 15.001 px"));
  evaluation.frames[0].missing = {"mesh.ply"};
  evaluation.total_metrics = {};
  EXPECT_THAT(ChecksOf(evaluation), ElementsAre("evaluate.frames 0.0 %"));
}

TEST(EvaluationVerdict, DistortionOfClothOfAnotherSizeIsThatOfTheScale) {
  JobEvaluation evaluation;
  evaluation.frames.resize(1);
  evaluation.total_metrics.distortion_relative = 0.08;
  const auto finding = [&](std::optional<double> print, std::optional<double> of_template) {
    evaluation.facts.print_scale = print, evaluation.facts.template_scale = of_template;
    return VerdictText(VerdictOf(evaluation));
  };
  const std::string begin = "geodesic distortion 8.00 %, since the cloth is ";
  EXPECT_THAT(finding(1.04, 0.9), HasSubstr(begin + "4.0 % too large as a whole"));
  EXPECT_THAT(finding({}, 0.96), HasSubstr(begin + "4.0 % too small as a whole"));
  EXPECT_THAT(finding({}, 0.96), Not(HasSubstr("weft template build")));
  for (const std::string& text : {finding({}, {}), finding(1.02, {})}) {
    EXPECT_THAT(text, Not(HasSubstr("since the cloth")));
    EXPECT_THAT(text,
                HasSubstr("  remedy: Check that the template is that of the garment: `weft template build`"));
  }
}

}  // namespace
}  // namespace weft
