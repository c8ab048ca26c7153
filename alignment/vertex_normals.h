// Normals of a mesh at its vertices.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

// Area-weighted unit normals of the vertices; zero for vertices without faces.
std::vector<Eigen::Vector3d> VertexNormals(const std::vector<Eigen::Vector3d>& vertices_mm,
                                           const std::vector<Face>& faces);

}  // namespace weft
