#include "evaluation/true_drift.h"

#include <Eigen/Dense>
#include <limits>

#include "alignment/vertex_normals.h"
#include "simulation/printed_mesh.h"

namespace weft {

TrueDrift::TrueDrift(const TriangleMesh& rest) : graph_(BuildMeshGraph(rest)) {
  const std::vector<Eigen::Vector3d> normals = VertexNormals(rest.vertices_mm, rest.faces);
  rest_edge_mm_.resize(graph_.neighbor.size());
  for (int v = 0; v < graph_.vertices; ++v) {
    const Eigen::Vector3d u = normals[v].unitOrthogonal(), w = normals[v].cross(u);
    for (int i = graph_.first[v]; i < graph_.first[v + 1]; ++i) {
      const Eigen::Vector3d edge = rest.vertices_mm[graph_.neighbor[i]] - rest.vertices_mm[v];
      rest_edge_mm_[i] = {edge.dot(u), edge.dot(w)};
    }
  }
}

std::vector<Eigen::Vector2d> TrueDrift::MaterialOffsets(const std::vector<Eigen::Vector3d>& registered_mm,
                                                        const std::vector<Eigen::Vector3d>& true_mm) const {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<Eigen::Vector2d> offsets(true_mm.size(), Eigen::Vector2d(kNone, kNone));
  for (int v = 0; v < graph_.vertices; ++v) {
    // Deformation gradient F, [3, 2]: least squares over the edges, edge = F rest_edge.
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    Eigen::Matrix<double, 3, 2> moment = Eigen::Matrix<double, 3, 2>::Zero();
    for (int i = graph_.first[v]; i < graph_.first[v + 1]; ++i) {
      if (!true_mm[graph_.neighbor[i]].allFinite()) continue;
      spread += rest_edge_mm_[i] * rest_edge_mm_[i].transpose();
      moment += (true_mm[graph_.neighbor[i]] - true_mm[v]) * rest_edge_mm_[i].transpose();
    }
    if (!(spread.determinant() > 1e-9 * spread.squaredNorm())) continue;
    const Eigen::Matrix<double, 3, 2> deformation = moment * spread.inverse();
    const Eigen::Matrix2d metric = deformation.transpose() * deformation;
    if (!(metric.determinant() > 1e-9 * metric.squaredNorm())) continue;
    offsets[v] = metric.inverse() * (deformation.transpose() * (registered_mm[v] - true_mm[v]));
  }
  return offsets;
}

std::vector<double> DriftBetween(const std::vector<Eigen::Vector2d>& offsets_mm,
                                 const std::vector<Eigen::Vector2d>& next_offsets_mm) {
  std::vector<double> drift;
  drift.reserve(offsets_mm.size());
  for (size_t v = 0; v < offsets_mm.size(); ++v) drift.push_back((next_offsets_mm[v] - offsets_mm[v]).norm());
  return drift;
}

}  // namespace weft
