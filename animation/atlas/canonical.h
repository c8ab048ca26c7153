// How the cloth at each vertex is turned against the mesh at rest: local offsets are told in axes that turn
// with it, so that whoever learns them need not know where in the room the cloth is.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alignment/mesh.h"
#include "alignment/mesh_graph.h"

namespace weft {

class CanonicalAxes {
 public:
  // Both must outlive it.
  CanonicalAxes(const TriangleMesh& rest, const MeshGraph& graph);

  // The rotation of the tangent plane at each vertex, and in it of one direction of the cloth, [vertices].
  // The identity where the cloth has no area. Columns are orthonormal. The same at any thread count.
  std::vector<Eigen::Matrix3f> RotationsOf(const std::vector<Eigen::Vector3d>& position_mm) const;

 private:
  Eigen::Matrix3f AxesAt(int v, const std::vector<Eigen::Vector3d>& position_mm) const;

  const TriangleMesh& rest_;
  const MeshGraph& graph_;
  std::vector<std::vector<int>> faces_of_;  // [vertices]
  std::vector<float> along_;                // [2 * edges of the graph], of a neighbour in the direction
  std::vector<Eigen::Matrix3f> at_rest_;
};

}  // namespace weft
