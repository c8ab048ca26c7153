// Cholesky factor of a sparse matrix in single precision, for right-hand sides of three columns.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

// L D L^T of a permuted matrix, factorised in double precision and solved with in single: good to about 1e-5,
// as preconditioners need it. Thread safety: const functions may be called from any number of threads.
class SingleFactor {
 public:
  SingleFactor() = default;
  // Of a symmetric positive definite matrix, of which the lower triangle is read. Internal: it is none.
  static absl::StatusOr<SingleFactor> Build(const Eigen::SparseMatrix<double>& lower);

  int size() const { return static_cast<int>(place_.size()); }
  // Where row i of the matrix stands in the right-hand side and in the solution.
  int place(int i) const { return place_[i]; }
  // Replaces the right-hand side, rows in their places, by the solution. The fourth column is room to spare.
  void Solve(std::vector<Eigen::Vector4f>* columns) const;

 private:
  std::vector<int32_t> place_;
  std::vector<int32_t> first_;  // [size + 1], of each column of L
  std::vector<int32_t> row_;    // below the diagonal
  std::vector<float> value_;
  std::vector<float> inverse_diagonal_;  // of D
};

}  // namespace weft
