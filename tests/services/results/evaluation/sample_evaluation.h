// An evaluation in which every field has a number of its own.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "services/results/evaluation/evaluate_job.h"

namespace weft {

// Numbers above `base` by 1 to 5 thousandths.
inline ErrorSummary ErrorsAbove(double base, int64_t count = 10) {
  return {count, base + 0.001, base + 0.002, base + 0.003, base + 0.004, base + 0.005};
}

inline FrameMetrics SampleMetrics() {
  FrameMetrics m;
  m.coverage = 0.8125, m.two_view_share = 0.125;
  m.distortion_mm = 1.25, m.distortion_relative = 0.015;
  m.self_intersections = 1234;
  m.texture_drift_mm = ErrorsAbove(1), m.texture_drift_mm_s = ErrorsAbove(2);
  m.texture_flow_lost = 0.0625;
  m.true_drift_observed_mm = ErrorsAbove(3), m.true_drift_inferred_mm = ErrorsAbove(4);
  m.true_drift_observed_mm_s = ErrorsAbove(5), m.true_drift_inferred_mm_s = ErrorsAbove(6);
  m.jitter_observed_mm = ErrorsAbove(7), m.jitter_inferred_mm = ErrorsAbove(8);
  m.jitter_of_truth_mm = ErrorsAbove(9);
  m.error_jitter_observed_mm = ErrorsAbove(10), m.error_jitter_inferred_mm = ErrorsAbove(11);
  m.error_change_mm = ErrorsAbove(12), m.error_change_mm_s = ErrorsAbove(13);
  m.reprojection_px = ErrorsAbove(14), m.left_out_px = ErrorsAbove(15);
  return m;
}

inline void AddErrors(const std::vector<double>& errors, ErrorTally& tally) {
  for (const double error : errors) tally.push_back(error);
}

inline FrameScore SampleScore() {
  FrameScore score;
  DecodeScore& centers = score.centers.emplace();
  centers.observations = 1000, centers.right = 990, centers.out_of_sight = 4;
  centers.scoreable = 1100, centers.found = 880;
  centers.by_pitch[1] = {300, 210}, centers.by_pitch[4] = {800, 670};
  AddErrors({0.125, 0.25, 0.375}, centers.errors_px);
  AddErrors({2, 4}, centers.wrong_px);
  DecodeScore& corners = score.corners.emplace();
  corners.observations = 500, corners.right = 480, corners.scoreable = 600, corners.found = 450;
  AddErrors({0.5}, corners.errors_px);
  CloudScore& cloud = score.cloud.emplace();
  cloud.points = 2000, cloud.points_of_unseen_cells = 7, cloud.well_seen = 1500, cloud.covered = 1200;
  AddErrors({0.5, 0.75}, cloud.errors_mm);
  MeshScore& mesh = score.mesh.emplace();
  AddErrors({1, 2, 9}, mesh.visible_mm);
  AddErrors({3, 5}, mesh.hidden_mm);
  AddErrors({1, 3}, mesh.with_point_mm);
  AddErrors({0.25, 0.75}, mesh.point_mm);
  mesh.far = 1;
  return score;
}

inline CameraErrors SampleCamera(const std::string& id, double px) {
  CameraErrors camera;
  camera.camera_id = id, camera.observations = 40, camera.outliers = 3;
  AddErrors({px, 2 * px}, camera.reprojection_px);
  AddErrors({3 * px, 5 * px}, camera.left_out_px);
  camera.shift_sum_px = {px, -px};
  return camera;
}

// A frame with everything and one without a file.
inline JobEvaluation SampleEvaluation() {
  JobEvaluation evaluation;
  evaluation.frames = {{"0001", {}, SampleScore(), SampleMetrics()},
                       {"0002", {"observations.csv", "cloud.ply", "mesh.ply"}, {}, {}}};
  evaluation.total = SampleScore(), evaluation.total_metrics = SampleMetrics();
  evaluation.cameras = {SampleCamera("c01", 0.25), CameraErrors{.camera_id = "c02", .observations = 2}};
  evaluation.remarks = {{"texture drift", "there are no pictures"}};
  evaluation.result = "/result", evaluation.truth = "/take/truth", evaluation.dump = "/take";
  evaluation.job_id = "j-7", evaluation.fps = 25, evaluation.fps_source = "--fps";
  evaluation.maps.visibility = {0, 0.05, 0.1, 0.95, 1};
  return evaluation;
}

// A table of comma-separated values on its side: a line per column, its heading first. Fields have no commas.
inline std::string OnItsSide(const std::string& csv) {
  std::vector<std::string> lines;
  for (size_t begin = 0, end; (end = csv.find('\n', begin)) != std::string::npos; begin = end + 1) {
    size_t column = 0;
    const std::vector<std::string> fields = absl::StrSplit(csv.substr(begin, end - begin), ",");
    for (const std::string& field : fields) {
      if (column == lines.size()) lines.emplace_back();
      if (begin > 0) lines[column] += ' ';
      lines[column++] += field.empty() ? "-" : field;
    }
  }
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace weft
