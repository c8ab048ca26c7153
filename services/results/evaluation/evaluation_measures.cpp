#include "services/results/evaluation/evaluation_measures.h"

namespace weft {
namespace {

using MeasureValue = std::optional<double>;
using Frame = const EvaluatedFrame&;

MeasureValue PartOf(const std::optional<ErrorSummary>& errors, double ErrorSummary::*field) {
  if (!errors) return std::nullopt;
  return (*errors).*field;
}

auto MeanOfSummary(std::optional<ErrorSummary> FrameMetrics::*field) {
  return [field](Frame f) { return PartOf(f.metrics.*field, &ErrorSummary::mean); };
}

auto MeanOfVertices(ErrorTally MeshScore::*kind) {
  return [kind](Frame f) {
    return f.score.mesh ? PartOf(Summarize((*f.score.mesh).*kind), &ErrorSummary::mean) : MeasureValue();
  };
}

MeasureValue PairsThatIntersect(Frame f) {
  if (!f.metrics.self_intersections) return std::nullopt;
  return static_cast<double>(*f.metrics.self_intersections);
}

// Of the frame alone, or against the truth.
std::vector<EvaluationMeasure> OfPositions() {
  constexpr auto kLower = BetterValue::kLower, kHigher = BetterValue::kHigher,
                 kNeither = BetterValue::kNeither;
  return {
      {"coverage", "Coverage, 3 cameras or more", "%", 1, kHigher,
       [](Frame f) { return f.metrics.coverage; }},
      {"two_view_share", "Measured by 2 cameras only", "%", 1, kNeither,
       [](Frame f) { return f.metrics.two_view_share; }},
      {"decode_precision", "Decoding, precision", "%", 2, kHigher,
       [](Frame f) { return f.score.centers ? f.score.centers->Precision() : MeasureValue(); }},
      {"decode_recall", "Decoding, recall", "%", 2, kHigher,
       [](Frame f) { return f.score.centers ? f.score.centers->Recall() : MeasureValue(); }},
      {"decode_median_px", "Decoding, error of centres, median", "px", 3, kLower,
       [](Frame f) {
         return f.score.centers ? PartOf(Summarize(f.score.centers->errors_px), &ErrorSummary::median)
                                : MeasureValue();
       }},
      {"cloud_coverage", "Cloud, vertices with a point", "%", 2, kHigher,
       [](Frame f) { return f.score.cloud ? f.score.cloud->Coverage() : MeasureValue(); }},
      {"cloud_median_mm", "Cloud, error, median", "mm", 3, kLower,
       [](Frame f) {
         return f.score.cloud ? PartOf(Summarize(f.score.cloud->errors_mm), &ErrorSummary::median)
                              : MeasureValue();
       }},
      {"mesh_visible_mean_mm", "Vertex error, seen by 3 or more", "mm", 3, kLower,
       MeanOfVertices(&MeshScore::visible_mm)},
      {"mesh_hidden_mean_mm", "Vertex error, seen by fewer", "mm", 3, kLower,
       MeanOfVertices(&MeshScore::hidden_mm)},
  };
}

std::vector<EvaluationMeasure> OfMotion() {
  constexpr auto kLower = BetterValue::kLower, kNeither = BetterValue::kNeither;
  const auto mean = [](const char* name, const char* title, const char* unit, int decimals,
                       BetterValue better, std::optional<ErrorSummary> FrameMetrics::*field) {
    return EvaluationMeasure{name, title, unit, decimals, better, MeanOfSummary(field)};
  };
  using M = FrameMetrics;
  return {
      mean("texture_drift_mm_s", "Drift by texture flow", "mm/s", 2, kLower, &M::texture_drift_mm_s),
      {"texture_flow_lost", "Texture flow, windows lost", "%", 1, kLower,
       [](Frame f) { return f.metrics.texture_flow_lost; }},
      mean("true_drift_observed_mm_s", "Exact drift, observed", "mm/s", 2, kLower,
           &M::true_drift_observed_mm_s),
      mean("true_drift_inferred_mm_s", "Exact drift, inferred", "mm/s", 2, kLower,
           &M::true_drift_inferred_mm_s),
      {"geodesic_distortion_mm", "Geodesic distortion", "mm", 2, kLower,
       [](Frame f) { return f.metrics.distortion_mm; }},
      {"geodesic_distortion_relative", "Geodesic distortion, of the distance", "%", 2, kLower,
       [](Frame f) { return f.metrics.distortion_relative; }},
      {"self_intersecting_pairs", "Self-intersections, pairs of faces", "", 1, kLower, PairsThatIntersect},
      // A mesh that is too smooth trembles less as well.
      mean("jitter_observed_mm", "Jitter, observed", "mm", 3, kNeither, &M::jitter_observed_mm),
      mean("jitter_inferred_mm", "Jitter, inferred", "mm", 3, kNeither, &M::jitter_inferred_mm),
      mean("jitter_of_truth_mm", "Jitter of the truth", "mm", 3, BetterValue::kReference,
           &M::jitter_of_truth_mm),
      mean("error_jitter_observed_mm", "Jitter of the error, observed", "mm", 3, kLower,
           &M::error_jitter_observed_mm),
      mean("error_jitter_inferred_mm", "Jitter of the error, inferred", "mm", 3, kLower,
           &M::error_jitter_inferred_mm),
      mean("reprojection_px", "Reprojection error", "px", 3, kLower, &M::reprojection_px),
      mean("left_out_px", "Left-out camera error", "px", 3, kLower, &M::left_out_px),
      mean("texture_drift_mm", "Drift by texture flow", "mm a frame", 3, kLower, &M::texture_drift_mm),
      mean("true_drift_observed_mm", "Exact drift, observed", "mm a frame", 3, kLower,
           &M::true_drift_observed_mm),
      mean("true_drift_inferred_mm", "Exact drift, inferred", "mm a frame", 3, kLower,
           &M::true_drift_inferred_mm),
      mean("error_change_mm", "Error, frame to frame, seen by 3 or more", "mm a frame", 3, kLower,
           &M::error_change_mm),
      mean("error_change_mm_s", "Error, frame to frame, seen by 3 or more", "mm/s", 2, kLower,
           &M::error_change_mm_s),
  };
}

}  // namespace

const std::vector<EvaluationMeasure>& EvaluationMeasures() {
  static const std::vector<EvaluationMeasure> measures = [] {
    std::vector<EvaluationMeasure> all = OfPositions();
    for (EvaluationMeasure& measure : OfMotion()) all.push_back(std::move(measure));
    return all;
  }();
  return measures;
}

}  // namespace weft
