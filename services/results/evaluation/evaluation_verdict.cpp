#include "services/results/evaluation/evaluation_verdict.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/verdict/verdict.h"

namespace weft {
namespace {

int64_t MissingMeshes(const JobEvaluation& evaluation) {
  return std::ranges::count_if(evaluation.frames, [](const EvaluatedFrame& frame) {
    return std::ranges::find(frame.missing, FileName(FrameFile::kMesh)) != frame.missing.end();
  });
}

void AddFrames(const JobEvaluation& evaluation, v1::Verdict& verdict) {
  const auto all = static_cast<int64_t>(evaluation.frames.size());
  const int64_t missing = MissingMeshes(evaluation);
  AddCheck(verdict, kEvaluateFrames, 100.0 * static_cast<double>(all - missing) / static_cast<double>(all),
           absl::StrCat(missing, " of ", all, " frames that were asked for have no mesh"));
}

void AddTruth(const FrameScore& total, v1::Verdict& verdict) {
  if (total.centers)
    if (const auto precision = total.centers->Precision())
      AddCheck(verdict, kEvaluatePrecision, 100 * *precision);
  if (total.mesh)
    if (const auto visible = Summarize(total.mesh->visible_mm))
      AddCheck(verdict, kEvaluateVertexError, visible->mean);
}

// Cloth of another size than its print strains every geodesic: that is no fault of the template.
void AddDistortion(const JobEvaluation& evaluation, v1::Verdict& verdict) {
  const double distortion = 100 * *evaluation.total_metrics.distortion_relative;
  const CameraFacts& facts = evaluation.facts;
  const std::optional<double>& scale = facts.print_scale ? facts.print_scale : facts.template_scale;
  const bool is_scale = scale && 100 * std::abs(*scale - 1) > kRegisterScale.good;
  AddCheck(verdict, kEvaluateDistortion, distortion,
           is_scale
               ? absl::StrFormat("geodesic distortion %.2f %%, since the cloth is %.1f %% too %s as a whole",
                                 distortion, 100 * std::abs(*scale - 1), *scale > 1 ? "large" : "small")
               : "",
           is_scale ? std::string(kRegisterScale.remedy) : "");
}

}  // namespace

v1::Verdict VerdictOf(const JobEvaluation& evaluation) {
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_GOOD, EvaluationHeadline(evaluation), "");
  const FrameMetrics& total = evaluation.total_metrics;
  AddFrames(evaluation, verdict);
  AddAgreementCheck(evaluation.facts.cameras, verdict);
  AddScaleCheck(evaluation.facts, verdict);
  AddSightCheck(evaluation.facts.cameras, verdict);
  AddRepeatCheck(evaluation.facts.cameras, verdict);
  AddKnownCheck(evaluation.facts, verdict);
  if (total.coverage && !evaluation.is_driven) AddCheck(verdict, kEvaluateCoverage, 100 * *total.coverage);
  AddTruth(evaluation.total, verdict);
  if (total.true_drift_observed_mm_s) {
    AddCheck(verdict, kEvaluateDrift, total.true_drift_observed_mm_s->mean);
  } else if (total.texture_drift_mm_s) {
    AddCheck(verdict, kEvaluateDrift, total.texture_drift_mm_s->mean);
  }
  if (total.distortion_relative) AddDistortion(evaluation, verdict);
  if (total.self_intersections) {
    const auto meshes =
        static_cast<double>(evaluation.frames.size()) - static_cast<double>(MissingMeshes(evaluation));
    AddCheck(verdict, kEvaluateSelfIntersections,
             static_cast<double>(*total.self_intersections) / std::max(1.0, meshes));
  }
  if (total.left_out_px) AddCheck(verdict, kEvaluateLeftOut, total.left_out_px->mean);
  return verdict;
}

std::string EvaluationHeadline(const JobEvaluation& evaluation) {
  const size_t frames = evaluation.frames.size();
  std::string headline = absl::StrCat(frames, frames == 1 ? " frame" : " frames");
  const FrameMetrics& total = evaluation.total_metrics;
  if (total.coverage && !evaluation.is_driven)
    absl::StrAppendFormat(&headline, ", %.1f %% of the cells seen by 3 cameras or more",
                          100 * *total.coverage);
  if (evaluation.total.mesh)
    if (const auto visible = Summarize(evaluation.total.mesh->visible_mm))
      absl::StrAppendFormat(&headline, ", vertex error %.3f mm", visible->mean);
  return headline;
}

}  // namespace weft
