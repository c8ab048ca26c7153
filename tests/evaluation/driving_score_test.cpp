#include "evaluation/driving_score.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/counter_random.h"
#include "evaluation/chamfer.h"

namespace weft {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

TEST(VertexRays, LeavesOutWhatLiesAlongTheRay) {
  VertexRays rays(2);
  rays.Add(0, Vector3d::UnitZ());
  EXPECT_DOUBLE_EQ(rays.AcrossMm(0, {3, 4, 50}), 5);
  // Two rays at right angles: one hides x, the other z.
  rays.Add(0, Vector3d::UnitX());
  EXPECT_DOUBLE_EQ(rays.AcrossMm(0, {3, 4, 5}), std::sqrt((9 + 16 + 16 + 25) / 2.0));
  EXPECT_EQ(rays.CountAt(0), 2);
  EXPECT_EQ(rays.CountAt(1), 0);
  EXPECT_DOUBLE_EQ(rays.AcrossMm(1, {3, 4, 0}), 5);
}

TEST(DrivingScore, TellsSeenFromUnseenVertices) {
  const std::vector<Vector3d> truth = {{0, 0, 0}, {100, 0, 0}, {200, 0, 0}};
  VertexRays rays(3);
  rays.Add(0, Vector3d::UnitX());
  DrivingScore score;
  ASSERT_TRUE(score.Add({{{2, 1, 0}, {100, 6, 0}, {200, 0, 90}}, {}}, truth, rays, true).ok());
  EXPECT_DOUBLE_EQ(score.seen_mm().Summary()->mean, std::sqrt(5));
  EXPECT_DOUBLE_EQ(score.across_mm().Summary()->mean, 1);
  EXPECT_DOUBLE_EQ(score.unseen_mm().Summary()->mean, 48);
  EXPECT_DOUBLE_EQ(*score.UnseenShare(), 2 / 3.0);
  EXPECT_EQ(score.lost(), 1);
  EXPECT_FALSE(score.ShareWithin(1));
}

TEST(DrivingScore, TellsWhereRaysCross) {
  VertexRays rays(2);
  rays.Add(0, Vector3d::UnitX()), rays.Add(1, Vector3d::UnitX()), rays.Add(1, Vector3d::UnitZ());
  DrivingScore one, both;
  ASSERT_TRUE(one.Add({{{5, 0, 0}, {0, 2, 0}}, {}}, {{0, 0, 0}, {0, 0, 0}}, rays, true).ok());
  both += one, both += one;
  ASSERT_EQ(both.crossed_mm().size(), 2u);
  EXPECT_DOUBLE_EQ(both.crossed_mm().Summary()->mean, 2);
}

// A mesh that shakes by 1 mm beside cloth that accelerates.
TEST(DrivingScore, JitterIsFreeOfTheClothsOwnMotion) {
  const VertexRays rays(1);
  DrivingScore smooth, shaking, broken;
  for (int t = 0; t < 9; ++t) {
    const std::vector<Vector3d> truth = {{7.0 * t * t, 0, 0}};
    const Vector3d shake(0, t % 2, 0);
    ASSERT_TRUE(smooth.Add({{truth[0] + Vector3d(5, 0, t)}, {}}, truth, rays, true).ok());
    ASSERT_TRUE(shaking.Add({{truth[0] + shake}, {}}, truth, rays, true).ok());
    ASSERT_TRUE(broken.Add({{truth[0] + shake}, {}}, truth, rays, t % 2 == 1).ok());
  }
  EXPECT_EQ(smooth.error_jitter_unseen_mm().size(), 7u);
  EXPECT_NEAR(smooth.error_jitter_unseen_mm().Summary()->max, 0, 1e-9);
  EXPECT_DOUBLE_EQ(shaking.error_jitter_unseen_mm().Summary()->mean, 2);
  EXPECT_TRUE(broken.error_jitter_unseen_mm().empty());
}

TEST(DrivingScore, CountsDistancesWithinSigma) {
  constexpr size_t kVertices = 20000;
  const std::vector<Vector3d> truth(kVertices, Vector3d::Zero());
  ScoredMesh mesh{truth, std::vector<float>(kVertices, 2)};
  for (size_t v = 0; v < kVertices; ++v)  // along one axis, so that the distance is normal as well
    mesh.vertices_mm[v].y() = 2 * NormalOf(7, v);
  DrivingScore score;
  ASSERT_TRUE(score.Add(mesh, truth, VertexRays(kVertices), true).ok());
  EXPECT_NEAR(*score.ShareWithin(1), 0.6827, 0.01);
  EXPECT_NEAR(*score.ShareWithin(2), 0.9545, 0.005);
}

TEST(DrivingScore, SequencesAddUpWithoutJitterBetweenThem) {
  const VertexRays rays(1);
  DrivingScore all;
  for (const double off : {0.0, 50.0}) {
    DrivingScore one;
    for (int t = 0; t < 3; ++t)
      ASSERT_TRUE(one.Add({{Vector3d(off, 0, 0)}, {}}, {Vector3d::Zero()}, rays, true).ok());
    all += one;
  }
  EXPECT_EQ(all.frames(), 6);
  EXPECT_DOUBLE_EQ(all.all_mm().Summary()->mean, 25);
  EXPECT_EQ(all.error_jitter_unseen_mm().size(), 2u);
  EXPECT_DOUBLE_EQ(all.error_jitter_unseen_mm().Summary()->max, 0);
}

TEST(DrivingScore, RefusesOtherMeshes) {
  DrivingScore score;
  EXPECT_THAT(
      std::string(score.Add({{Vector3d::Zero()}, {}}, {{0, 0, 0}, {1, 0, 0}}, VertexRays(2), true).message()),
      HasSubstr("has 1 vertices, the truth 2"));
  const Vector3d nowhere(std::nan(""), 0, 0);
  EXPECT_THAT(std::string(score.Add({{nowhere}, {}}, {Vector3d::Zero()}, VertexRays(1), true).message()),
              HasSubstr("vertex 0 of the driven mesh is not finite"));
  EXPECT_EQ(score.frames(), 0);
}

}  // namespace
}  // namespace weft
