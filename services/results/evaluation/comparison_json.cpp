// A comparison as weft.v1.Comparison.

#include "services/results/evaluation/comparison_text.h"
#include "services/results/evaluation/evaluation_text.h"
#include "weft/v1/comparison.pb.h"

namespace weft {
namespace {

static_assert(static_cast<int>(ComparisonOutcome::kAHigher) == v1::COMPARISON_OUTCOME_A_HIGHER);

v1::ComparedMeasure MeasureToProto(const ComparedMeasure& compared) {
  v1::ComparedMeasure out;
  out.set_measure(compared.measure->name);
  out.set_title(compared.measure->title);
  out.set_unit(compared.measure->unit);
  out.set_frames(static_cast<uint32_t>(compared.frames));
  out.set_a(compared.a);
  out.set_b(compared.b);
  out.set_difference(compared.a - compared.b);
  out.set_outcome(static_cast<v1::ComparisonOutcome>(compared.outcome));
  if (!compared.test) return out;
  out.set_standard_error(compared.test->standard_error);
  out.set_degrees_of_freedom(static_cast<uint32_t>(compared.test->degrees_of_freedom));
  out.set_p(compared.test->p);
  out.set_p_adjusted(compared.p_adjusted);
  return out;
}

v1::MeshDifferenceScore DifferenceToProto(const FrameDifference& difference) {
  v1::MeshDifferenceScore out;
  if (difference.distance_mm) *out.mutable_distance_mm() = ErrorSummaryMessage(*difference.distance_mm);
  if (difference.beyond_sigmas_share) out.set_beyond_sigmas_share(*difference.beyond_sigmas_share);
  return out;
}

void AddRemarks(const std::string& prefix, const std::vector<EvaluationRemark>& remarks,
                v1::Comparison& out) {
  for (const EvaluationRemark& remark : remarks) {
    v1::EvaluationRemark& added = *out.add_remarks();
    added.set_measure(prefix + remark.metric);
    added.set_reason(remark.reason);
  }
}

}  // namespace

v1::Comparison ComparisonMessage(const JobComparison& comparison) {
  v1::Comparison out;
  out.set_a(comparison.a.result);
  out.set_b(comparison.b.result);
  for (const ComparedMeasure& compared : comparison.measures) *out.add_measures() = MeasureToProto(compared);
  *out.mutable_meshes() = DifferenceToProto(comparison.total);
  for (size_t f = 0; f < comparison.frames.size(); ++f) {
    v1::ComparedFrame& frame = *out.add_frames();
    frame.set_frame(comparison.a.frames[f].frame);
    *frame.mutable_meshes() = DifferenceToProto(comparison.frames[f]);
  }
  for (const JobDifference& difference : comparison.differences) {
    v1::JobDifference& added = *out.add_differences();
    added.set_what(difference.what);
    added.set_a(difference.a);
    added.set_b(difference.b);
  }
  AddRemarks("", comparison.remarks, out);
  AddRemarks("A: ", comparison.a.remarks, out);
  AddRemarks("B: ", comparison.b.remarks, out);
  out.set_significance_level(kSignificanceLevel);
  out.set_truth(comparison.a.truth);
  out.set_frames_per_s(comparison.a.fps);
  return out;
}

}  // namespace weft
