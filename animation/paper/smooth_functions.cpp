#include "animation/paper/smooth_functions.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/counter_random.h"

namespace weft {
namespace {

constexpr int kIterations = 12;
// The subspace is larger than what is asked of it, so that the last functions come out as well.
constexpr double kSpare = 1.3;
// Keeps the operator definite; of its mean diagonal.
constexpr double kShift = 1e-6;
// The weight of function i is exp(-i / kFall).
constexpr double kFall = 20;

}  // namespace

absl::StatusOr<Eigen::MatrixXf> SmoothFunctions(const MeshGraph& graph, int count) {
  const Eigen::Index vertices = graph.vertices;
  const Eigen::Index wanted = std::min<Eigen::Index>(count, vertices);
  const Eigen::Index columns =
      std::min<Eigen::Index>(vertices, static_cast<Eigen::Index>(kSpare * static_cast<double>(wanted)) + 2);
  std::vector<Eigen::Triplet<double>> entries;
  double trace = 0;
  for (int v = 0; v < graph.vertices; ++v)
    for (int i = graph.first[v]; i < graph.first[v + 1]; ++i) {
      entries.emplace_back(v, v, graph.cotan_weight[i]);
      entries.emplace_back(v, graph.neighbor[i], -graph.cotan_weight[i]);
      trace += graph.cotan_weight[i];
    }
  for (int v = 0; v < graph.vertices; ++v)
    entries.emplace_back(v, v, std::max(1e-12, kShift * trace / static_cast<double>(vertices)));
  Eigen::SparseMatrix<double> laplacian(vertices, vertices);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(laplacian);
  if (solver.info() != Eigen::Success)
    return absl::InternalError("the mesh's Laplacian has no inverse; is a face degenerate?");
  Eigen::MatrixXd space(vertices, columns);
  for (Eigen::Index i = 0; i < space.size(); ++i) space.data()[i] = NormalOf(1, static_cast<uint64_t>(i));
  for (int round = 0; round < kIterations; ++round) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(solver.solve(space));
    space = qr.householderQ() * Eigen::MatrixXd::Identity(vertices, columns);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> small(space.transpose() * (laplacian * space));
  return (space * small.eigenvectors().leftCols(wanted) * std::sqrt(static_cast<double>(vertices)))
      .cast<float>();
}

Eigen::VectorXf RandomMix(const Eigen::MatrixXf& functions, double scale_mm, uint64_t key) {
  Eigen::VectorXf weights(functions.cols());
  for (Eigen::Index i = 0; i < weights.size(); ++i)
    weights[i] = UniformOf(key, static_cast<uint64_t>(2 * i + 2)) < 0.5
                     ? 0.0f
                     : static_cast<float>(std::exp(-static_cast<double>(i) / kFall));
  return static_cast<float>(scale_mm * NormalOf(key, 0)) * (functions * weights);
}

}  // namespace weft
