#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/results/report/mesh_view.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

const Eigen::Vector3d kWorldUp = -Eigen::Vector3d::UnitY();

// A rectangle around the origin.
std::vector<Eigen::Vector3d> BroadSheet(const Eigen::Vector3d& across, const Eigen::Vector3d& along) {
  std::vector<Eigen::Vector3d> vertices;
  for (const double u : {-100.0, 0.0, 100.0})
    for (const double v : {-150.0, 0.0, 150.0}) vertices.emplace_back(u * across + v * along);
  return vertices;
}

TEST(Viewpoint, LooksAtTheBroadSide) {
  const double angle = M_PI / 6;
  const Eigen::Vector3d across(std::cos(angle), 0, -std::sin(angle)),
      normal(std::sin(angle), 0, std::cos(angle));
  const auto front = ViewpointOf(BroadSheet(across, Eigen::Vector3d::UnitY()), MeshSide::kFront, kWorldUp);
  ASSERT_TRUE(front.ok()) << front.status();
  EXPECT_NEAR((front->towards_viewer + normal).norm(), 0, 1e-9);
  EXPECT_NEAR((front->up - kWorldUp).norm(), 0, 1e-9);
  EXPECT_NEAR((front->right - across).norm(), 0, 1e-9);
}

TEST(Viewpoint, TheBackIsSeenAfterHalfATurn) {
  const auto sheet = BroadSheet(Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
  const auto back = ViewpointOf(sheet, MeshSide::kBack, kWorldUp);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_NEAR((back->towards_viewer - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-9);
  EXPECT_NEAR((back->right + Eigen::Vector3d::UnitX()).norm(), 0, 1e-9);
}

TEST(Viewpoint, WhatLiesFlatIsSeenFromAbove) {
  const auto view =
      ViewpointOf(BroadSheet(Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()), MeshSide::kFront, kWorldUp);
  ASSERT_TRUE(view.ok()) << view.status();
  EXPECT_NEAR((view->towards_viewer - kWorldUp).norm(), 0, 1e-9);
  EXPECT_NEAR((view->up - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-9);
}

TEST(Viewpoint, RefusesWhatHasNoView) {
  EXPECT_THAT(std::string(ViewpointOf({}, MeshSide::kFront, kWorldUp).status().message()),
              HasSubstr("no vertices"));
  EXPECT_THAT(ViewpointOf({kWorldUp}, MeshSide::kFront, Eigen::Vector3d::Zero()).status().message(),
              HasSubstr("up: "));
  const Eigen::Vector3d endless(0, std::numeric_limits<double>::infinity(), 0);
  EXPECT_THAT(ViewpointOf({kWorldUp, endless}, MeshSide::kFront, kWorldUp).status().message(),
              HasSubstr("vertex 1"));
}

}  // namespace
}  // namespace weft
