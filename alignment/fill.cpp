#include "alignment/fill.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "absl/status/status.h"

namespace weft {

absl::Status LaplacianFill(const MeshGraph& graph, const std::vector<bool>& known,
                           std::vector<Eigen::Vector3d>* values) {
  std::vector<bool> anchored(graph.components, false);
  for (int v = 0; v < graph.vertices; ++v) {
    if (known[v]) anchored[graph.component[v]] = true;
  }
  std::vector<int> unknowns, index(graph.vertices, -1);
  for (int v = 0; v < graph.vertices; ++v) {
    if (known[v] || !anchored[graph.component[v]]) continue;
    index[v] = static_cast<int>(unknowns.size());
    unknowns.push_back(v);
  }
  if (unknowns.empty()) return absl::OkStatus();

  Eigen::SparseMatrix<double> laplacian(unknowns.size(), unknowns.size());
  laplacian.reserve(Eigen::VectorXi::Constant(unknowns.size(), 8));
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(unknowns.size(), 3);
  for (size_t i = 0; i < unknowns.size(); ++i) {
    const int v = unknowns[i];
    double diagonal = 0;
    for (int j = graph.first[v]; j < graph.first[v + 1]; ++j) {
      const int other = graph.neighbor[j];
      const double weight = graph.cotan_weight[j];
      diagonal += weight;
      if (index[other] < 0) {
        right.row(i) += weight * (*values)[other].transpose();
      } else if (index[other] > static_cast<int>(i)) {
        laplacian.insert(index[other], i) = -weight;
      }
    }
    laplacian.insert(i, i) = diagonal;
  }
  laplacian.makeCompressed();
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(laplacian);
  if (factor.info() != Eigen::Success) {
    return absl::InternalError("fill: the Laplacian of the unseen vertices could not be factorised");
  }
  const Eigen::MatrixX3d solution = factor.solve(right);
  for (size_t i = 0; i < unknowns.size(); ++i) (*values)[unknowns[i]] = solution.row(i);
  return absl::OkStatus();
}

}  // namespace weft
