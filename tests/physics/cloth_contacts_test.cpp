#include "physics/cloth_contacts.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <vector>

#include "alignment/untangle/self_intersection.h"

namespace weft {
namespace {

using Eigen::Vector3d;

TEST(KeepApart, HoldsBackAVertexOnItsWayThroughAFaceOnly) {
  const std::vector<Face> faces = {{0, 1, 2}};
  const std::vector<Vector3d> from = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {2, 2, 1}, {20, 20, 1}};
  ContactFinder finder(5, faces, 4);
  const std::vector<ContactPair> pairs = finder.Find(from, Eigen::Isometry3d::Identity());
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_NEAR(pairs[0].distance_mm, 1, 1e-6);
  std::vector<Vector3d> to = from;
  to[3].z() = -0.5;
  to[4].z() = 0;
  EXPECT_GT(KeepApart(pairs, from, Eigen::Isometry3d::Identity(), {4, 1}, to).held_back, 0);
  EXPECT_GT(to[3].z(), 0);
  EXPECT_EQ(to[4].z(), 0);
  // A motion that all have in common is free.
  const Eigen::Isometry3d carry(Eigen::Translation3d(0, 0, 50));
  to = from;
  for (Vector3d& p : to) p = carry * p;
  EXPECT_EQ(KeepApart(pairs, from, carry, {4, 1}, to).held_back, 0);
}

// Two triangles that nearly touch.
class KeepLayersApart : public testing::Test {
 protected:
  static constexpr double kNear = 0.02;
  const std::vector<Face> faces = {{0, 1, 2}, {3, 4, 5}};
  const std::vector<Vector3d> from = {{0, 0, 0},     {20, 0, 0},     {0, 20, 0},
                                      {1, 2, kNear}, {19, 2, kNear}, {1, 18, kNear}};
  ContactFinder finder = ContactFinder(6, faces, 8);
  const std::vector<ContactPair> pairs = finder.Find(from, Eigen::Isometry3d::Identity());
};

TEST_F(KeepLayersApart, LetsElementsTurnTogetherHoweverNearTheyAre) {
  const Eigen::AngleAxisd turn(0.02, Vector3d(1, 1, 0).normalized());
  std::vector<Vector3d> to;
  for (const Vector3d& p : from) to.push_back(turn * p);
  const std::vector<Vector3d> turned = to;
  EXPECT_EQ(KeepApart(pairs, from, Eigen::Isometry3d::Identity(), {8, 2}, to).held_back, 0);
  EXPECT_EQ(to, turned);
  // One that turns into the other does not pass.
  for (int v = 3; v < 6; ++v) to[v] = from[v];
  const KeptApart kept = KeepApart(pairs, from, Eigen::Isometry3d::Identity(), {8, 2}, to);
  EXPECT_GT(kept.held_back, 0);
  EXPECT_TRUE(FindSelfIntersections(to, faces).empty());
}

// Layers that are pressed against each other while both are swept along: what cannot come nearer goes along.
TEST_F(KeepLayersApart, WhatNoShorterWayKeepsApartMovesAsOne) {
  const Vector3d sweep(1.2, 0.3, 0), into(0, 0, -1.5);
  std::vector<Vector3d> to = from;
  for (int v = 0; v < 6; ++v) to[v] += v < 3 ? sweep : Vector3d(sweep + into);
  const KeptApart kept = KeepApart(pairs, from, Eigen::Isometry3d::Identity(), {8, 2}, to);
  EXPECT_FALSE(kept.stuck.empty());
  EXPECT_TRUE(FindSelfIntersections(to, faces).empty());
  for (int v = 0; v < 6; ++v) {
    EXPECT_LT((to[v] - from[v] - sweep).head<2>().norm(), 0.05) << v;
    for (int w = 0; w < v; ++w) EXPECT_NEAR((to[v] - to[w]).norm(), (from[v] - from[w]).norm(), 1e-9);
  }
  // Cloth without a body stands still.
  to = from;
  for (int v = 0; v < 6; ++v) to[v] += v < 3 ? sweep : Vector3d(sweep + into);
  KeepApart(pairs, from, Eigen::Isometry3d::Identity(), {8, 2, false}, to);
  EXPECT_EQ(to[0], from[0]);
}

}  // namespace
}  // namespace weft
