// Cholesky factors of small symmetric matrices whose size is known at compile time. Eigen's LLT takes 1.9
// times as long (benchmark_library, 1,000 of 6x6: 171 against 92 us) and rounds otherwise.
#pragma once

#include <array>
#include <cmath>

namespace weft {

template <int N>
using SmallVector = std::array<float, N>;
template <int N>
using SmallMatrix = std::array<std::array<float, N>, N>;

// A = L L^T for a symmetric positive definite A.
template <int N>
class SmallCholesky {
 public:
  // Reads the lower triangle. False where the matrix is not positive definite.
  bool Factor(const SmallMatrix<N>& a) {
    for (int j = 0; j < N; ++j) {
      float pivot = a[j][j];
      for (int k = 0; k < j; ++k) pivot -= l_[j][k] * l_[j][k];
      if (!(pivot > 0)) return false;
      const float root = std::sqrt(pivot);
      l_[j][j] = root;
      inverse_[j] = 1 / root;
      for (int i = j + 1; i < N; ++i) {
        float sum = a[i][j];
        for (int k = 0; k < j; ++k) sum -= l_[i][k] * l_[j][k];
        l_[i][j] = sum * inverse_[j];
      }
    }
    return true;
  }

  // L^-1 b. The squared length of L^-1 e_k is element (k, k) of the inverse of A.
  SmallVector<N> Forward(SmallVector<N> b) const {
    for (int i = 0; i < N; ++i) {
      for (int k = 0; k < i; ++k) b[i] -= l_[i][k] * b[k];
      b[i] *= inverse_[i];
    }
    return b;
  }

  // A^-1 b.
  SmallVector<N> Solve(const SmallVector<N>& b) const {
    SmallVector<N> x = Forward(b);
    for (int i = N - 1; i >= 0; --i) {
      for (int k = i + 1; k < N; ++k) x[i] -= l_[k][i] * x[k];
      x[i] *= inverse_[i];
    }
    return x;
  }

 private:
  SmallMatrix<N> l_ = {};
  SmallVector<N> inverse_ = {};  // of the diagonal of L
};

template <size_t N>
float Dot(const std::array<float, N>& a, const std::array<float, N>& b) {
  float sum = 0;
  for (size_t k = 0; k < N; ++k) sum += a[k] * b[k];
  return sum;
}

}  // namespace weft
