// The smoothest functions on a mesh: what a surface can be displaced by without being torn.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "absl/status/statusor.h"
#include "alignment/mesh_graph.h"

namespace weft {

// Eigenfunctions of the mesh's Laplace-Beltrami operator (cotangent weights, all vertices of one mass), the
// smoothest first, [vertices][count], each of root mean square 1; fewer where the mesh has fewer vertices. By
// inverse subspace iteration, so that those with nearly the same eigenvalue may be mixed. Internal: the
// system has no solution.
absl::StatusOr<Eigen::MatrixXf> SmoothFunctions(const MeshGraph& graph, int count);

// Halimi et al. 2022's augmentation: of each function nothing or all, falling with its number, times a normal
// number; in mm of `scale_mm`, [vertices].
Eigen::VectorXf RandomMix(const Eigen::MatrixXf& functions, double scale_mm, uint64_t key);

}  // namespace weft
