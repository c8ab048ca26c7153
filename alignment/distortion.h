// The energies of section 5.4 of the paper, written down plainly. The solver works on a reduced form.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alignment/mesh_graph.h"

namespace weft {

// A deformation: vertex k carries the rigid transformation x -> rotation[k] (x - rest[k]) + position[k].
struct Deformation {
  std::vector<Eigen::Vector3d> position_mm;
  std::vector<Eigen::Matrix3d> rotation;
};

// Weights of the two parts of the reduced distortion energy of an edge. Eq. 2 of the paper is {3, 0.5}; a
// lower bending weight gives narrow folds their curvature back, on observed vertices and on hidden ones.
struct DistortionWeights {
  double stretch = 3;     // of |d - (a + b) / 2|^2
  double bending = 0.05;  // of |a - b|^2
};

// Eq. 2 of the paper: over the edges, the squared distances between the images of both ends and of the
// midpoint under the transformations of both ends.
double DistortionEnergy(const TriangleMesh& rest, const MeshGraph& graph, const Deformation& deformation);

// The same in reduced form. An edge k-l has the rest vector e. Put a = R_k e, b = R_l e, d = c_l - c_k, m
// = (a + b) / 2 and h = (a - b) / 2. The transformation of k moves v_k + t e to c_k + t a, that of l to
// c_l - (1 - t) b. They differ by d - t a - (1 - t) b. For t = 0, 1/2, 1 that is d - m + h, d - m and d -
// m - h. The sum of squares is 3 |d - m|^2 + 2 |h|^2 = 3 |d - (a + b)/2|^2 + 1/2 |a - b|^2.
double ReducedDistortionEnergy(const TriangleMesh& rest, const MeshGraph& graph,
                               const Deformation& deformation, const DistortionWeights& weights);

// Eq. 1 of the paper, weighted: sum of (target_k - c_k)^T weight_k (target_k - c_k).
double DetectionEnergy(const std::vector<Eigen::Vector3d>& targets_mm,
                       const std::vector<Eigen::Matrix3d>& weights,
                       const std::vector<Eigen::Vector3d>& position_mm);

}  // namespace weft
