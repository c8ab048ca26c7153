// The measures of one frame, and of the step to the next one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "evaluation/error_summary.h"
#include "evaluation/true_drift.h"
#include "services/results/evaluation/evaluation_inputs.h"

namespace weft {

// Measures that need no truth, and those of motion. Empty where a piece is missing.
struct FrameMetrics {
  // Of the vertices with a cell: measured by three or more cameras, as the paper counts, and by two.
  std::optional<double> coverage, two_view_share;
  std::optional<double> distortion_mm, distortion_relative;
  std::optional<int64_t> self_intersections;  // pairs of faces
  // To the next frame; per second as well where the frame rate is known.
  std::optional<ErrorSummary> texture_drift_mm, texture_drift_mm_s;  // of the vertices that could be measured
  std::optional<double> texture_flow_lost;  // share of the windows whose flow did not come back
  // Observed: by two or more cameras; all other vertices are inferred.
  std::optional<ErrorSummary> true_drift_observed_mm, true_drift_inferred_mm;
  std::optional<ErrorSummary> true_drift_observed_mm_s, true_drift_inferred_mm_s;
  std::optional<ErrorSummary> jitter_observed_mm, jitter_inferred_mm, jitter_of_truth_mm;
  std::optional<ErrorSummary> error_jitter_observed_mm, error_jitter_inferred_mm;  // of the vertices' errors
  std::optional<ErrorSummary> error_change_mm, error_change_mm_s;                  // of well seen vertices
  std::optional<ErrorSummary> reprojection_px, left_out_px;
};

struct EvaluatedFrame {
  std::string frame;
  std::vector<std::string> missing;  // file names of the result that are not there
  FrameScore score;                  // against the truth
  FrameMetrics metrics;
};

// Values per vertex for the maps on the garment, [vertices]; NaN: not measured, empty: of no vertex.
struct VertexFields {
  std::vector<double> observed;  // 1 by three or more cameras, else 0
  std::vector<double> error_mm, distortion_mm;
  std::vector<double> texture_drift_mm, true_drift_mm;  // to the next frame
};

struct FrameOutcome {
  EvaluatedFrame frame;
  VertexFields fields;
  std::vector<CameraErrors> cameras;
};

// What is prepared once per job.
struct EvaluationTools {
  std::optional<GeodesicDistortion> geodesics;
  std::optional<TextureDrift> texture;
  std::optional<TrueDrift> true_drift;
  double cell_mm = 0;
  std::vector<bool> measure_geodesics, measure_texture;  // [frames]
};
absl::StatusOr<EvaluationTools> PrepareTools(const EvaluationRequest& request,
                                             const EvaluationInputs& inputs);

// Errors name the file. Parallel in the calling thread's TBB arena.
absl::StatusOr<FrameOutcome> EvaluateFrame(const EvaluationRequest& request, const EvaluationInputs& inputs,
                                           const EvaluationTools& tools, size_t index);

}  // namespace weft
