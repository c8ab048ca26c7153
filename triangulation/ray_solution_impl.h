// What systems of normal equations say, a part of the body of the ray kernels (ray_kernel_impl.h); see
// simd/lanes.h.
#pragma once

#include "simd/lanes.h"
#include "triangulation/ray_kernel.h"
#include "triangulation/ray_rows_impl.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

typedef int64_t LongLanes __attribute__((vector_size(8 * kHalf)));

// Symmetric 3x3 matrices: xx xy xz yy yz zz.
struct SymmetricDoubles {
  // The inverse times the determinant.
  SymmetricDoubles Adjoint() const {
    return {{m[3] * m[5] - m[4] * m[4], m[2] * m[4] - m[1] * m[5], m[1] * m[4] - m[2] * m[3],
             m[0] * m[5] - m[2] * m[2], m[1] * m[2] - m[0] * m[4], m[0] * m[3] - m[1] * m[1]}};
  }
  Doubles Determinant(const SymmetricDoubles& adjoint) const {
    return m[0] * adjoint.m[0] + m[1] * adjoint.m[1] + m[2] * adjoint.m[2];
  }

  Doubles m[6];
};

inline Doubles Widened(const float* p) { return __builtin_convertvector(LoadAs<HalfLanes>(p), Doubles); }
inline void Store(Doubles v, double* p) { std::memcpy(p, &v, sizeof v); }
inline void Store(LongLanes mask, int32_t* p) {
  typedef int32_t HalfInts __attribute__((vector_size(4 * kHalf)));
  const HalfInts narrow = __builtin_convertvector(mask, HalfInts);
  std::memcpy(p, &narrow, sizeof narrow);
}

inline void Solve(const GroupSystem& system, GroupSolution* solution) {
  constexpr double kLeastPivot = 1e-12;
  // Newton's matrix serves where it keeps this share of the other one's determinant. With .5 and thirty steps
  // four nodes of plain_path_test miss their point, with .1 and twenty none does.
  constexpr double kLeastShare = 0.1;
  for (int first = 0; first < kNodeLanes; first += kHalf) {
    SymmetricDoubles robust, newton;
    for (int k = 0; k < 6; ++k) {
      robust.m[k] = Widened(system.matrix[k] + first);
      newton.m[k] = robust.m[k] - Widened(system.surplus[k] + first);
    }
    const SymmetricDoubles robust_adjoint = robust.Adjoint(), newton_adjoint = newton.Adjoint();
    const Doubles minor = robust_adjoint.m[5];
    const Doubles determinant = robust.Determinant(robust_adjoint);
    const Doubles newton_determinant = newton.Determinant(newton_adjoint);
    const LongLanes solvable = (robust.m[0] > kLeastPivot) & (minor > kLeastPivot * robust.m[0]) &
                               (determinant > kLeastPivot * minor);
    const LongLanes serves = newton_determinant > kLeastShare * determinant;
    const Doubles scale = 1.0 / determinant, newton_scale = 1.0 / newton_determinant;
    Doubles newton_inverse[6], gradient[3];
    for (int k = 0; k < 6; ++k) {
      Store(robust_adjoint.m[k] * scale, solution->covariance_mm2[k] + first);
      newton_inverse[k] = newton_adjoint.m[k] * newton_scale;
    }
    for (int k = 0; k < 3; ++k) gradient[k] = Widened(system.gradient[k] + first);
    constexpr int kRows[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (int k = 0; k < 3; ++k) {
      Doubles step = {};
      for (int j = 0; j < 3; ++j) step += newton_inverse[kRows[k][j]] * gradient[j];
      Store(step, solution->newton_step_mm[k] + first);
    }
    Store(solvable, solution->solvable + first);
    Store(serves, solution->newton + first);
  }
}

}  // namespace
}  // namespace weft::WEFT_KERNEL_NAMESPACE
