#include "alignment/elastic_preconditioner.h"

#include <Eigen/SparseCore>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/field_algebra.h"

namespace weft {
namespace {

constexpr double kWeakShare = 0.004;  // weight against the sum of the edges' weights

}  // namespace

absl::StatusOr<ElasticPreconditioner> ElasticPreconditioner::Build(const SlicedMesh& mesh,
                                                                   const MeshGraph& graph,
                                                                   const ElasticProblem& problem,
                                                                   const ElasticOptions& options) {
  const double stretch = options.lambda * options.distortion.stretch;
  ElasticPreconditioner out;
  out.inverse_diagonal_.assign(mesh.degree.size(), 0);
  std::vector<int> index(graph.vertices, -1);
  for (int v = 0; v < graph.vertices; ++v) {
    if (!problem.frozen.empty() && problem.frozen[v]) continue;
    const double edges = stretch * graph.degree(v), weight = problem.weights[v].trace() / 3;
    out.inverse_diagonal_[v] = static_cast<float>(1 / (weight + edges));
    if (weight >= kWeakShare * edges) continue;
    index[v] = static_cast<int>(out.weak_.size());
    out.weak_.push_back(v);
  }
  if (out.weak_.empty()) return out;
  Eigen::SparseMatrix<double> matrix(out.weak_.size(), out.weak_.size());
  matrix.reserve(Eigen::VectorXi::Constant(out.weak_.size(), 8));
  for (size_t i = 0; i < out.weak_.size(); ++i) {
    const int v = out.weak_[i];
    for (int j = graph.first[v]; j < graph.first[v + 1]; ++j) {
      const int other = index[graph.neighbor[j]];
      if (other > static_cast<int>(i)) matrix.insert(other, i) = -stretch;
    }
    matrix.insert(i, i) = problem.weights[v].trace() / 3 + stretch * graph.degree(v);
  }
  matrix.makeCompressed();
  absl::StatusOr<SingleFactor> factor = SingleFactor::Build(matrix);
  if (!factor.ok()) {
    return absl::InternalError(absl::StrCat("elastic solver: unseen vertices: ", factor.status().message()));
  }
  out.factor_ = *std::move(factor);
  return out;
}

void ElasticPreconditioner::Apply(const Field3& in, Field3* out) const {
  ForEachBlock(static_cast<int>(inverse_diagonal_.size()) / kSliceLanes, [&](int, SliceRange range) {
    for (int i = range.first * kSliceLanes; i < range.last * kSliceLanes; ++i) {
      out->x[i] = inverse_diagonal_[i] * in.x[i];
      out->y[i] = inverse_diagonal_[i] * in.y[i];
      out->z[i] = inverse_diagonal_[i] * in.z[i];
    }
  });
  if (weak_.empty()) return;
  std::vector<Eigen::Vector4f> columns(weak_.size());
  for (size_t i = 0; i < weak_.size(); ++i) {
    const int v = weak_[i];
    columns[factor_.place(static_cast<int>(i))] = {in.x[v], in.y[v], in.z[v], 0};
  }
  factor_.Solve(&columns);
  for (size_t i = 0; i < weak_.size(); ++i) {
    const Eigen::Vector4f& solution = columns[factor_.place(static_cast<int>(i))];
    const int v = weak_[i];
    out->x[v] = solution.x(), out->y[v] = solution.y(), out->z[v] = solution.z();
  }
}

}  // namespace weft
