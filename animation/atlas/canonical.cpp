#include "animation/atlas/canonical.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>

#include "alignment/vertex_normals.h"

namespace weft {

CanonicalAxes::CanonicalAxes(const TriangleMesh& rest, const MeshGraph& graph)
    : rest_(rest), graph_(graph), faces_of_(graph.vertices), along_(graph.neighbor.size(), 0) {
  for (size_t f = 0; f < rest.faces.size(); ++f)
    for (const int v : rest.faces[f]) faces_of_[v].push_back(static_cast<int>(f));
  const std::vector<Eigen::Vector3d> normals = VertexNormals(rest.vertices_mm, rest.faces);
  for (int v = 0; v < graph.vertices; ++v) {
    if (graph.degree(v) == 0) continue;
    // Towards the first neighbour; every neighbour says a share of it, by how far it lies that way.
    const Eigen::Vector3d first = rest.vertices_mm[graph.neighbor[graph.first[v]]] - rest.vertices_mm[v];
    const Eigen::Vector3d along = (first - normals[v] * normals[v].dot(first)).normalized();
    for (int i = graph.first[v]; i < graph.first[v + 1]; ++i)
      along_[i] = static_cast<float>(along.dot(rest.vertices_mm[graph.neighbor[i]] - rest.vertices_mm[v]));
  }
  for (int v = 0; v < graph.vertices; ++v) at_rest_.push_back(AxesAt(v, rest.vertices_mm));
}

Eigen::Matrix3f CanonicalAxes::AxesAt(int v, const std::vector<Eigen::Vector3d>& position_mm) const {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), along = Eigen::Vector3d::Zero();
  for (const int f : faces_of_[v]) {
    const Face& face = rest_.faces[f];
    const Eigen::Vector3d& a = position_mm[face[0]];
    normal += (position_mm[face[1]] - a).cross(position_mm[face[2]] - a);
  }
  for (int i = graph_.first[v]; i < graph_.first[v + 1]; ++i)
    along += along_[i] * (position_mm[graph_.neighbor[i]] - position_mm[v]);
  if (!(normal.norm() > 1e-9)) return Eigen::Matrix3f::Identity();
  normal.normalize();
  along -= normal * normal.dot(along);
  if (!(along.norm() > 1e-9)) return Eigen::Matrix3f::Identity();
  along.normalize();
  Eigen::Matrix3f out;
  out << along.cast<float>(), normal.cross(along).cast<float>(), normal.cast<float>();
  return out;
}

std::vector<Eigen::Matrix3f> CanonicalAxes::RotationsOf(
    const std::vector<Eigen::Vector3d>& position_mm) const {
  std::vector<Eigen::Matrix3f> out(graph_.vertices);
  tbb::parallel_for(0, graph_.vertices,
                    [&](int v) { out[v] = AxesAt(v, position_mm) * at_rest_[v].transpose(); });
  return out;
}

}  // namespace weft
