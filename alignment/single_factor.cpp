#include "alignment/single_factor.h"

#include <Eigen/SparseCholesky>

#include "absl/status/status.h"

namespace weft {

absl::StatusOr<SingleFactor> SingleFactor::Build(const Eigen::SparseMatrix<double>& lower) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(lower);
  if (factor.info() != Eigen::Success) return absl::InternalError("the matrix could not be factorised");
  const Eigen::SparseMatrix<double> below = factor.matrixL().nestedExpression();
  const Eigen::VectorXd diagonal = factor.vectorD();
  SingleFactor out;
  const int size = static_cast<int>(lower.rows());
  out.place_.assign(factor.permutationP().indices().begin(), factor.permutationP().indices().end());
  out.first_.assign(1, 0);
  for (int column = 0; column < size; ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(below, column); it; ++it) {
      if (it.row() == column) continue;  // 1
      out.row_.push_back(static_cast<int32_t>(it.row()));
      out.value_.push_back(static_cast<float>(it.value()));
    }
    out.first_.push_back(static_cast<int32_t>(out.row_.size()));
    out.inverse_diagonal_.push_back(static_cast<float>(1 / diagonal[column]));
  }
  return out;
}

void SingleFactor::Solve(std::vector<Eigen::Vector4f>* columns) const {
  Eigen::Vector4f* const x = columns->data();
  for (int j = 0; j < size(); ++j) {
    const Eigen::Vector4f own = x[j];
    for (int p = first_[j]; p < first_[j + 1]; ++p) x[row_[p]] -= value_[p] * own;
    x[j] = inverse_diagonal_[j] * own;
  }
  for (int j = size() - 1; j >= 0; --j) {
    Eigen::Vector4f own = x[j];
    for (int p = first_[j]; p < first_[j + 1]; ++p) own -= value_[p] * x[row_[p]];
    x[j] = own;
  }
}

}  // namespace weft
