// What the elastic solver minimises, and how.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "alignment/distortion.h"

namespace weft {

struct ElasticOptions {
  double lambda = 1;  // of E_Dist against E_Det
  DistortionWeights distortion;
  double tolerance = 1e-4;  // ends when an iteration lowers the energy by less than this share
  int max_iterations = 200;

  absl::Status Validate() const;
};

// What draws the vertices: the sum over them of (x - target)^T weight (x - target). Eq. 1, 3, 4 and 5 of the
// paper all have this form, and so has any sum of them (its constant left out).
struct ElasticProblem {
  std::vector<Eigen::Vector3d> targets_mm;  // [vertices]
  std::vector<Eigen::Matrix3d> weights;     // [vertices], symmetric, positive definite
  std::vector<bool> frozen;                 // [vertices], or empty: vertices whose position stays

  // Adds (x - target)^T weight (x - target); weight positive semi-definite.
  void Add(int vertex, const Eigen::Vector3d& target_mm, const Eigen::Matrix3d& weight);
};

}  // namespace weft
