#include "alignment/vertex_normals.h"

#include <Eigen/Geometry>

namespace weft {

std::vector<Eigen::Vector3d> VertexNormals(const std::vector<Eigen::Vector3d>& vertices_mm,
                                           const std::vector<Face>& faces) {
  std::vector<Eigen::Vector3d> normals(vertices_mm.size(), Eigen::Vector3d::Zero());
  for (const Face& f : faces) {
    const Eigen::Vector3d twice_area =
        (vertices_mm[f[1]] - vertices_mm[f[0]]).cross(vertices_mm[f[2]] - vertices_mm[f[0]]);
    for (const int v : f) normals[v] += twice_area;
  }
  for (Eigen::Vector3d& n : normals) {
    const double length = n.norm();
    if (length > 0) n /= length;
  }
  return normals;
}

}  // namespace weft
