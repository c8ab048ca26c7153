#include "pattern/fit/small_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace weft {
namespace {

TEST(SmallCholesky, SolvesAsEigenDoes) {
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  for (int round = 0; round < 20; ++round) {
    Eigen::Matrix<float, 6, 6> root;
    Eigen::Matrix<float, 6, 1> target;
    for (int p = 0; p < 6; ++p) {
      for (int q = 0; q < 6; ++q) root(p, q) = normal(random);
      target[p] = normal(random);
    }
    const Eigen::Matrix<float, 6, 6> matrix =
        root * root.transpose() + 0.5f * Eigen::Matrix<float, 6, 6>::Identity();
    SmallMatrix<6> a;
    SmallVector<6> b;
    for (int p = 0; p < 6; ++p) {
      for (int q = 0; q < 6; ++q) a[p][q] = matrix(p, q);
      b[p] = target[p];
    }
    SmallCholesky<6> solver;
    ASSERT_TRUE(solver.Factor(a));
    const SmallVector<6> x = solver.Solve(b);
    const Eigen::Matrix<float, 6, 6> inverse = matrix.inverse();
    const Eigen::Matrix<float, 6, 1> expected = matrix.llt().solve(target);
    for (int k = 0; k < 6; ++k) {
      EXPECT_NEAR(x[k], expected[k], 1e-3f * expected.norm());
      SmallVector<6> unit = {};
      unit[k] = 1;
      const SmallVector<6> whitened = solver.Forward(unit);
      EXPECT_NEAR(Dot(whitened, whitened), inverse(k, k), 1e-3f * inverse.norm());
    }
  }
}

TEST(SmallCholesky, RefusesMatricesThatAreNotPositiveDefinite) {
  SmallCholesky<2> solver;
  EXPECT_TRUE(solver.Factor({{{2, 1}, {1, 2}}}));
  EXPECT_FALSE(solver.Factor({{{1, 2}, {2, 1}}}));
  EXPECT_FALSE(solver.Factor({{{0, 0}, {0, 0}}}));
  EXPECT_FALSE(solver.Factor({{{NAN, 0}, {0, 1}}}));
}

}  // namespace
}  // namespace weft
