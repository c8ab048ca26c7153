// The chaos floor: how far two simulations of one motion come apart, though nothing but the time step
// differs. Folds bifurcate, so no method that knows the motion alone can be expected to come nearer.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "alignment/mesh.h"
#include "evaluation/error_tally.h"

namespace weft {

// Collects frames of two simulations that began in the same state.
class ChaosFloor {
 public:
  // The first moments, in which the difference still grows from nothing, would flatter the floor.
  static constexpr double kSkippedS = 0.5;

  // Positions in mm, [vertices] of both, at `time_s` after the common state; earlier than kSkippedS is left
  // out. Frames follow each other.
  void Add(double time_s, const std::vector<Eigen::Vector3d>& a_mm, const std::vector<Eigen::Vector3d>& b_mm,
           const std::vector<Face>& faces);

  int frames() const { return frames_; }
  // Distance of the vertices, and angle between their normals; empty without frames.
  std::optional<ErrorSummary> DistanceMm() const { return distance_mm_.Summary(); }
  std::optional<ErrorSummary> NormalsDeg() const { return normals_deg_.Summary(); }
  // Length of the second difference of the distance over three frames, which DrivingScore measures of driven
  // meshes; empty with fewer.
  std::optional<ErrorSummary> ErrorJitterMm() const { return error_jitter_mm_.Summary(); }
  // Mean distance of each frame, in their order.
  const std::vector<double>& FrameMeansMm() const { return frame_means_mm_; }

 private:
  int frames_ = 0;
  ErrorTally distance_mm_, normals_deg_, error_jitter_mm_;
  std::vector<double> frame_means_mm_;
  std::vector<std::vector<Eigen::Vector3d>> recent_mm_;  // differences of the last two frames at most
};

}  // namespace weft
