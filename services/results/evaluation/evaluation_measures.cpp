#include "services/results/evaluation/evaluation_measures.h"

#include <algorithm>

namespace weft {
namespace {

using MeasureValue = std::optional<double>;
using Evaluated = const EvaluatedFrame&;
using M = FrameMetrics;

// Counts add up over the frames.
constexpr FrameMetric kFrameMetrics[] = {
    {"coverage", &M::coverage},
    {"two_view_share", &M::two_view_share},
    {"texture_drift_mm_s", &M::texture_drift_mm_s},
    {"texture_flow_lost", &M::texture_flow_lost},
    {"true_drift_observed_mm_s", &M::true_drift_observed_mm_s},
    {"true_drift_inferred_mm_s", &M::true_drift_inferred_mm_s},
    {"geodesic_distortion_mm", &M::distortion_mm},
    {"geodesic_distortion_relative", &M::distortion_relative},
    {"self_intersecting_pairs", &M::self_intersections},
    {"jitter_observed_mm", &M::jitter_observed_mm},
    {"jitter_inferred_mm", &M::jitter_inferred_mm},
    {"jitter_of_truth_mm", &M::jitter_of_truth_mm},
    {"error_jitter_observed_mm", &M::error_jitter_observed_mm},
    {"error_jitter_inferred_mm", &M::error_jitter_inferred_mm},
    {"reprojection_px", &M::reprojection_px},
    {"left_out_px", &M::left_out_px},
    {"texture_drift_mm", &M::texture_drift_mm},
    {"true_drift_observed_mm", &M::true_drift_observed_mm},
    {"true_drift_inferred_mm", &M::true_drift_inferred_mm},
    {"error_change_mm", &M::error_change_mm},
    {"error_change_mm_s", &M::error_change_mm_s},
};

MeasureValue PartOf(const std::optional<ErrorSummary>& errors, double ErrorSummary::*field) {
  if (!errors) return std::nullopt;
  return (*errors).*field;
}

MeasureValue AsNumber(const std::optional<ErrorSummary>& errors) {
  return PartOf(errors, &ErrorSummary::mean);
}
MeasureValue AsNumber(const std::optional<double>& value) { return value; }
MeasureValue AsNumber(const std::optional<int64_t>& count) {
  if (!count) return std::nullopt;
  return static_cast<double>(*count);
}

auto MeanOfVertices(ErrorTally MeshScore::*kind) {
  return [kind](Evaluated f) {
    return f.score.mesh ? AsNumber(Summarize((*f.score.mesh).*kind)) : MeasureValue();
  };
}

// Against the truth; FrameMetrics has the rest.
std::vector<EvaluationMeasure> OfScores() {
  return {
      {MeasureNamed("decode_precision"),
       [](Evaluated f) { return f.score.centers ? f.score.centers->Precision() : MeasureValue(); }},
      {MeasureNamed("decode_recall"),
       [](Evaluated f) { return f.score.centers ? f.score.centers->Recall() : MeasureValue(); }},
      {MeasureNamed("decode_median_px"),
       [](Evaluated f) {
         return f.score.centers ? PartOf(Summarize(f.score.centers->errors_px), &ErrorSummary::median)
                                : MeasureValue();
       }},
      {MeasureNamed("cloud_coverage"),
       [](Evaluated f) { return f.score.cloud ? f.score.cloud->Coverage() : MeasureValue(); }},
      {MeasureNamed("cloud_median_mm"),
       [](Evaluated f) {
         return f.score.cloud ? PartOf(Summarize(f.score.cloud->errors_mm), &ErrorSummary::median)
                              : MeasureValue();
       }},
      {MeasureNamed("mesh_visible_mean_mm"), MeanOfVertices(&MeshScore::visible_mm)},
      {MeasureNamed("mesh_hidden_mean_mm"), MeanOfVertices(&MeshScore::hidden_mm)},
  };
}

}  // namespace

std::span<const FrameMetric> FrameMetricFields() { return kFrameMetrics; }

const std::vector<EvaluationMeasure>& EvaluationMeasures() {
  static const std::vector<EvaluationMeasure> measures = [] {
    std::vector<EvaluationMeasure> all = OfScores();
    for (const FrameMetric& metric : kFrameMetrics)
      all.push_back({MeasureNamed(metric.name), [&metric](Evaluated f) {
                       return std::visit([&](auto field) { return AsNumber(f.metrics.*field); },
                                         metric.field);
                     }});
    const auto place = [](const EvaluationMeasure& measure) { return &MeasureNamed(measure.name); };
    std::ranges::sort(all, {}, place);
    return all;
  }();
  return measures;
}

}  // namespace weft
