// Positions for the vertices without a measurement (paper, section 5.4.2, initialisation).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh_graph.h"

namespace weft {

// Laplacian fill: every vertex for which `known` is false becomes the cotangent-weighted mean of its
// neighbours, by one sparse Cholesky factorisation. `values` [vertices] is changed in place. Vertices of
// components without any known vertex keep their values.
absl::Status LaplacianFill(const MeshGraph& graph, const std::vector<bool>& known,
                           std::vector<Eigen::Vector3d>* values);

}  // namespace weft
