#include "animation/rays/evidence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "tests/animation/drive_room.h"

namespace weft {
namespace {

using testing::HasSubstr;

// Four vertices: two centres of cells, a corner, and one that is no node.
Template SmallGarment() {
  Template out;
  out.id = "small";
  out.rest.vertices_mm = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {10, 10, 0}};
  out.node_of_vertex = {{2, 3, NodeKind::kCenter}, {2, 4, NodeKind::kCenter}, {2, 4, NodeKind::kCorner}, {}};
  return out;
}

Observation Seen(const CameraModel& camera, const Eigen::Vector3d& point_mm, const BoardNode& node) {
  const Eigen::Vector2d pixel = *camera.Project(point_mm);
  return {pixel.x(), pixel.y(), node, 0.1f, 1};
}

TEST(Evidence, RaysPassThroughWhatWasSeen) {
  const CameraModel front = CameraAt("front", 0, {0, 0, 0}), side = CameraAt("side", 70, {0, 0, 0});
  const Eigen::Vector3d point(30, -120, 45);
  const std::vector<Observation> in_front = {Seen(front, point, {2, 4, NodeKind::kCenter})},
                                 from_side = {Seen(side, point, {2, 4, NodeKind::kCenter})};
  const std::vector<DrivingView> views = {{&front, in_front}, {&side, from_side}};
  const auto rays = RaysOf(views, NodeVertices(SmallGarment()), 0);
  ASSERT_TRUE(rays.ok()) << rays.status();
  ASSERT_EQ(rays->size(), 2u);
  for (const VertexRay& ray : *rays) {
    EXPECT_EQ(ray.vertex, 1);
    EXPECT_LT(ray.OffsetTo(point).norm(), 1e-6);
    // A tenth of a pixel at this distance.
    EXPECT_NEAR(ray.SigmaMm(point), 0.1 / 2600 * (point - ray.origin_mm).norm(), 1e-7);
  }
}

TEST(Evidence, RaysOfThreeViewsTriangulate) {
  const Eigen::Vector3d point(30, -120, 45);
  RayEvidence evidence;
  for (const double azimuth : {0.0, 120.0, 240.0}) {
    const CameraModel camera = CameraAt("c", azimuth, {0, 0, 0});
    const std::vector<Observation> seen = {Seen(camera, point, {2, 3, NodeKind::kCenter})};
    const std::vector<DrivingView> views = {{&camera, seen}};
    const auto rays = RaysOf(views, NodeVertices(SmallGarment()), 0.3);
    ASSERT_TRUE(rays.ok()) << rays.status();
    evidence.Add(rays->front(), point, 1);
    if (evidence.rays == 1) {
      // One ray says nothing about the way along it.
      EXPECT_NEAR((evidence.information * rays->front().direction).norm() / evidence.information.norm(), 0,
                  1e-12);
    }
  }
  EXPECT_LT((evidence.information.ldlt().solve(evidence.moment) - point).norm(), 1e-6);
}

TEST(Evidence, OrderOfViewsDoesNotMatter) {
  const CameraModel a = CameraAt("a", 0, {0, 0, 0}), b = CameraAt("b", 90, {0, 0, 0});
  const std::vector<Observation> of_a = {Seen(a, {1, 2, 3}, {2, 4, NodeKind::kCorner}),
                                         Seen(a, {4, 5, 6}, {2, 3, NodeKind::kCenter})},
                                 of_b = {Seen(b, {4, 5, 6}, {2, 3, NodeKind::kCenter})};
  const std::vector<DrivingView> ab = {{&a, of_a}, {&b, of_b}}, ba = {{&b, of_b}, {&a, of_a}};
  const NodeVertices nodes(SmallGarment());
  const auto one = RaysOf(ab, nodes, 0.3), other = RaysOf(ba, nodes, 0.3);
  ASSERT_TRUE(one.ok() && other.ok());
  ASSERT_EQ(one->size(), 3u);
  for (size_t i = 0; i < one->size(); ++i) {
    EXPECT_EQ((*one)[i].vertex, (*other)[i].vertex);
    EXPECT_EQ((*one)[i].view, (*other)[i].view);
    EXPECT_EQ((*one)[i].direction, (*other)[i].direction);
  }
  EXPECT_EQ((*one)[0].vertex, 0);
  EXPECT_EQ((*one)[2].vertex, 2);
}

TEST(Evidence, ForeignCellsArePassedOverAndTheMoreConfidentOfTwoCounts) {
  const CameraModel a = CameraAt("a", 0, {0, 0, 0});
  Observation good = Seen(a, {4, 5, 6}, {2, 3, NodeKind::kCenter}), bad = good;
  bad.x_px += 40, bad.confidence = 0.6f;
  const std::vector<Observation> seen = {bad, good, Seen(a, {1, 2, 3}, {90, 90, NodeKind::kCenter}),
                                         Seen(a, {1, 2, 3}, {2, 3, NodeKind::kCorner})};
  const std::vector<DrivingView> views = {{&a, seen}};
  const auto rays = RaysOf(views, NodeVertices(SmallGarment()), 0.3);
  ASSERT_TRUE(rays.ok()) << rays.status();
  ASSERT_EQ(rays->size(), 1u);
  EXPECT_LT(rays->front().OffsetTo({4, 5, 6}).norm(), 1e-6);
}

TEST(Evidence, NamesWhatIsWrongWithAView) {
  const NodeVertices nodes(SmallGarment());
  const CameraModel a = CameraAt("a", 0, {0, 0, 0});
  const std::vector<DrivingView> twice = {{&a, {}}, {&a, {}}}, none = {{nullptr, {}}};
  EXPECT_THAT(RaysOf(twice, nodes, 0.3).status().message(), HasSubstr("camera a is there twice"));
  EXPECT_THAT(RaysOf(none, nodes, 0.3).status().message(), HasSubstr("without camera"));
  Observation bad = Seen(a, {4, 5, 6}, {2, 3, NodeKind::kCenter});
  bad.y_px = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Observation> seen = {bad};
  const std::vector<DrivingView> broken = {{&a, seen}};
  EXPECT_THAT(RaysOf(broken, nodes, 0.3).status().message(), HasSubstr("node 2, 3 is not finite"));
}

TEST(Evidence, OfTwoAsConfidentTheSharperCountsAndThenTheLeftAndUpper) {
  const CameraModel a = CameraAt("a", 0, {0, 0, 0});
  const NodeVertices nodes(SmallGarment());
  const auto ray_of = [&](std::vector<Observation> seen) {
    const std::vector<DrivingView> views = {{&a, seen}};
    return RaysOf(views, nodes, 0.3)->at(0);
  };
  const Observation base = Seen(a, {4, 5, 6}, {2, 3, NodeKind::kCenter});
  Observation sharper = base, right = base, lower = base;
  sharper.sigma_px = 0.05f, sharper.x_px += 9;
  right.x_px += 5;
  lower.y_px += 5;
  for (const auto& [better, worse] :
       {std::pair(sharper, base), std::pair(base, right), std::pair(base, lower), std::pair(lower, right)}) {
    const Eigen::Vector3d expected = ray_of({better}).direction;
    EXPECT_EQ(ray_of({better, worse}).direction, expected);
    EXPECT_EQ(ray_of({worse, better}).direction, expected);
  }
  const VertexRay ray = ray_of({base});
  EXPECT_NEAR(ray.sigma_rad, std::hypot(0.1, 0.3) / 2600, 1e-9);
  EXPECT_EQ(ray.focal_px, 2600);
  EXPECT_EQ(ray.origin_mm, a.CenterWorld());
}

TEST(Evidence, EveryNumberOfAnObservationIsChecked) {
  const NodeVertices nodes(SmallGarment());
  const CameraModel a = CameraAt("a", 0, {0, 0, 0});
  const Observation good = Seen(a, {4, 5, 6}, {2, 3, NodeKind::kCenter});
  const auto why_not = [&](const Observation& observation) {
    const std::vector<Observation> seen = {good, observation};
    const std::vector<DrivingView> views = {{&a, seen}};
    return std::string(RaysOf(views, nodes, 0.3).status().message());
  };
  EXPECT_EQ(why_not(good), "");
  for (const int field : {0, 1, 2, 3}) {
    Observation bad = good;
    if (field == 0) bad.x_px = std::numeric_limits<double>::infinity();
    if (field == 1) bad.y_px = std::numeric_limits<double>::infinity();
    if (field == 2) bad.sigma_px = -0.1f;
    if (field == 3) bad.sigma_px = std::numeric_limits<float>::infinity();
    EXPECT_EQ(why_not(bad), "camera a: the observation of node 2, 3 is not finite, or has a negative sigma");
  }
  Observation exact = good;
  exact.sigma_px = 0;
  EXPECT_EQ(why_not(exact), "");
  CameraModel broken = a;
  broken.fx_px = 0;
  const std::vector<DrivingView> views = {{&broken, {}}};
  EXPECT_FALSE(RaysOf(views, nodes, 0.3).ok());
}

TEST(Evidence, NodesAreNamedByRowColumnAndKind) {
  const NodeVertices nodes(SmallGarment());
  EXPECT_EQ(nodes.VertexOf({2, 3, NodeKind::kCenter}), 0);
  EXPECT_EQ(nodes.VertexOf({2, 4, NodeKind::kCenter}), 1);
  EXPECT_EQ(nodes.VertexOf({2, 4, NodeKind::kCorner}), 2);
  for (const BoardNode& none : {BoardNode{2, 3, NodeKind::kCorner},
                                {3, 3, NodeKind::kCenter},
                                {-1, 3, NodeKind::kCenter},
                                {2, -1, NodeKind::kCenter},
                                {-1, -1, NodeKind::kCenter},
                                {4, 2, NodeKind::kCenter}})
    EXPECT_EQ(nodes.VertexOf(none), -1) << none.row << " " << none.col;
}

TEST(Evidence, CountsByWeightAndDistance) {
  const VertexRay ray{0, 0, {0, 0, -1000}, {0, 0, 1}, 1e-3, 2600};
  RayEvidence evidence;
  evidence.Add(ray, {0, 0, 0}, 2);
  // Sigma is 1 mm there.
  EXPECT_LT((evidence.information - Eigen::Matrix3d(Eigen::Vector3d(2, 2, 0).asDiagonal())).norm(), 1e-12);
  EXPECT_LT(evidence.moment.norm(), 1e-9);
  evidence.Add({0, 0, {5, 0, -2000}, {0, 0, 1}, 1e-3, 2600}, {0, 0, 0}, 1);
  EXPECT_NEAR(evidence.information(0, 0), 2 + 1 / 4.000025, 1e-9);
  EXPECT_NEAR(evidence.moment.x(), 5 / 4.000025, 1e-9);
  EXPECT_EQ(evidence.rays, 2);
}

}  // namespace
}  // namespace weft
