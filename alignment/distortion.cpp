#include "alignment/distortion.h"

namespace weft {

double DistortionEnergy(const TriangleMesh& rest, const MeshGraph& graph, const Deformation& deformation) {
  const auto image = [&](int k, const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return deformation.rotation[k] * (x - rest.vertices_mm[k]) + deformation.position_mm[k];
  };
  double energy = 0;
  for (const MeshEdge& edge : graph.edges) {
    const Eigen::Vector3d &v_k = rest.vertices_mm[edge.a], &v_l = rest.vertices_mm[edge.b];
    for (const double t : {0.0, 0.5, 1.0}) {
      const Eigen::Vector3d s = (1 - t) * v_k + t * v_l;
      energy += (image(edge.a, s) - image(edge.b, s)).squaredNorm();  // Eq. 2
    }
  }
  return energy;
}

double ReducedDistortionEnergy(const TriangleMesh& rest, const MeshGraph& graph,
                               const Deformation& deformation, const DistortionWeights& weights) {
  double energy = 0;
  for (const MeshEdge& edge : graph.edges) {
    const Eigen::Vector3d e = rest.vertices_mm[edge.b] - rest.vertices_mm[edge.a];
    const Eigen::Vector3d a = deformation.rotation[edge.a] * e, b = deformation.rotation[edge.b] * e;
    const Eigen::Vector3d d = deformation.position_mm[edge.b] - deformation.position_mm[edge.a];
    energy += weights.stretch * (d - 0.5 * (a + b)).squaredNorm() + weights.bending * (a - b).squaredNorm();
  }
  return energy;
}

double DetectionEnergy(const std::vector<Eigen::Vector3d>& targets_mm,
                       const std::vector<Eigen::Matrix3d>& weights,
                       const std::vector<Eigen::Vector3d>& position_mm) {
  double energy = 0;
  for (size_t k = 0; k < targets_mm.size(); ++k) {
    const Eigen::Vector3d off = targets_mm[k] - position_mm[k];
    energy += off.dot(weights[k] * off);  // Eq. 1
  }
  return energy;
}

}  // namespace weft
