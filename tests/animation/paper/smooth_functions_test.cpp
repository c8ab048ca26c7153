#include "animation/paper/smooth_functions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "alignment/mesh.h"
#include "tests/animation/recorded.h"

namespace weft {
namespace {

// A long strip, whose smoothest functions are cosines along it.
constexpr int kColumns = 61, kRows = 3;

MeshGraph LongStrip() {
  TriangleMesh mesh;
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kColumns; ++c) mesh.vertices_mm.emplace_back(10 * c, 10 * r, 0);
  for (int r = 0; r + 1 < kRows; ++r)
    for (int c = 0; c + 1 < kColumns; ++c) {
      const int a = r * kColumns + c;
      mesh.faces.push_back({a, a + 1, a + kColumns});
      mesh.faces.push_back({a + 1, a + kColumns + 1, a + kColumns});
    }
  return BuildMeshGraph(mesh);
}

TEST(SmoothFunctions, AreOrthogonalAndOfOneSize) {
  const Eigen::MatrixXf functions = *SmoothFunctions(LongStrip(), 12);
  ASSERT_EQ(functions.cols(), 12);
  const Eigen::MatrixXf products = functions.transpose() * functions / static_cast<float>(functions.rows());
  EXPECT_LT((products - Eigen::MatrixXf::Identity(12, 12)).cwiseAbs().maxCoeff(), 1e-3f);
}

TEST(SmoothFunctions, OfAStripAreCosines) {
  const Eigen::MatrixXf functions = *SmoothFunctions(LongStrip(), 4);
  for (int k = 0; k < 4; ++k) {
    Eigen::VectorXf cosine(functions.rows());
    for (int v = 0; v < functions.rows(); ++v)
      cosine[v] = static_cast<float>(std::cos(std::numbers::pi * k * (v % kColumns) / (kColumns - 1.0)));
    cosine.normalize();
    EXPECT_GT(std::abs(cosine.dot(functions.col(k).normalized())), 0.99f) << k;
  }
}

TEST(RandomMixes, AreSmoothAndOfTheScale) {
  const Eigen::MatrixXf functions = *SmoothFunctions(LongStrip(), 12);
  double squares = 0, steps = 0;
  for (uint64_t key = 0; key < 400; ++key) {
    const Eigen::VectorXf mix = RandomMix(functions, 2, key);
    squares += mix.squaredNorm() / static_cast<double>(mix.size()) / 400;
    for (int c = 0; c + 1 < kColumns; ++c) steps += std::pow(mix[c + 1] - mix[c], 2) / 400 / (kColumns - 1);
  }
  // Half of twelve functions, each squared exp(-i / 10) times 2^2.
  double expected = 0;
  for (int i = 0; i < 12; ++i) expected += 0.5 * 4 * std::exp(-i / 10.0);
  EXPECT_NEAR(squares, expected, 0.3 * expected);
  EXPECT_LT(steps, 0.1 * squares);
}

TEST(SmoothFunctions, StayAsTheyAre) {
  const Eigen::MatrixXf functions = *SmoothFunctions(LongStrip(), 10);
  Recorded recorded;
  recorded.Add("functions", functions);
  for (const uint64_t key : {1, 2, 3}) recorded.Add("mix", RandomMix(functions, 2, key));
  recorded.Expect();
}

TEST(SmoothFunctions, OfFewVerticesAreAsMany) {
  TriangleMesh mesh;
  mesh.vertices_mm = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {10, 10, 0}};
  mesh.faces = {{0, 1, 2}, {1, 3, 2}};
  const Eigen::MatrixXf functions = *SmoothFunctions(BuildMeshGraph(mesh), 12);
  EXPECT_EQ(functions.rows(), 4);
  EXPECT_EQ(functions.cols(), 4);
}

}  // namespace
}  // namespace weft
