#include "figure/capsule.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numbers>
#include <utility>

namespace weft {
namespace {

using Eigen::Vector3d;

// Of even thickness, along x.
Capsule EvenCapsule() { return {Vector3d(0, 0, 0), Vector3d(100, 0, 0), 10, 10}; }

TEST(CapsuleDistance, IsThatToTheAxisLessTheRadius) {
  const SurfaceDistance flank = DistanceTo(EvenCapsule(), {50, 30, 40});
  EXPECT_DOUBLE_EQ(flank.distance_mm, 40);
  EXPECT_LT((flank.normal - Vector3d(0, 0.6, 0.8)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(DistanceTo(EvenCapsule(), {50, 0, 4}).distance_mm, -6);
}

TEST(CapsuleDistance, BeyondTheEndsIsThatToTheirSpheres) {
  const SurfaceDistance before = DistanceTo(EvenCapsule(), {-30, 40, 0});
  EXPECT_DOUBLE_EQ(before.distance_mm, 40);
  EXPECT_LT((before.normal - Vector3d(-0.6, 0.8, 0)).norm(), 1e-12);
  const SurfaceDistance behind = DistanceTo(EvenCapsule(), {125, 0, 0});
  EXPECT_DOUBLE_EQ(behind.distance_mm, 15);
  EXPECT_LT((behind.normal - Vector3d(1, 0, 0)).norm(), 1e-12);
}

TEST(CapsuleDistance, OnTheAxisAnyDirectionAcrossItWillDo) {
  const SurfaceDistance inside = DistanceTo(EvenCapsule(), {50, 0, 0});
  EXPECT_NEAR(inside.distance_mm, -10, 1e-5);
  EXPECT_NEAR(inside.normal.norm(), 1, 1e-12);
  EXPECT_NEAR(inside.normal.x(), 0, 1e-12);
}

// The surface is the envelope of the spheres: each vertex lies on one of them, and within none.
TEST(CapsuleMesh, VerticesLieOnTheSpheresThatItConsistsOf) {
  const Capsule tapered = {Vector3d(5, -3, 2), Vector3d(25, 77, 42), 30, 10};
  const std::vector<Vector3d> vertices = CapsuleVertices(tapered);
  ASSERT_EQ(vertices.size(), static_cast<size_t>(CapsuleVertexCount()));
  for (const Vector3d& v : vertices) {
    double least = 1e9;  // to the surface of the nearest of many spheres
    for (int i = 0; i <= 10'000; ++i) {
      const double t = i / 10'000.0;
      const Vector3d center = tapered.a + t * (tapered.b - tapered.a);
      least = std::min(least, (v - center).norm() - (tapered.ra + t * (tapered.rb - tapered.ra)));
    }
    EXPECT_NEAR(least, 0, 1e-4) << v.transpose();
  }
}

TEST(CapsuleMesh, IsClosedAndItsFacesLookOutwards) {
  std::vector<Face> faces;
  AppendCapsuleFaces(0, faces);
  const std::vector<Vector3d> vertices = CapsuleVertices(EvenCapsule());
  std::map<std::pair<int, int>, int> sides;
  double volume = 0;
  for (const Face& face : faces) {
    for (size_t k = 0; k < 3; ++k) ++sides[{face[k], face[(k + 1) % 3]}];
    volume += vertices[face[0]].dot(vertices[face[1]].cross(vertices[face[2]])) / 6;
  }
  for (const auto& [edge, count] : sides) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(sides.contains({edge.second, edge.first}));
  }
  // Euler: a closed surface without holes.
  EXPECT_EQ(vertices.size() + faces.size(), sides.size() / 2 + 2);
  // A cylinder and a sphere, less what the corners of 32 chords lack.
  const double exact = std::numbers::pi * 100 * 100 + 4.0 / 3 * std::numbers::pi * 1000;
  EXPECT_GT(volume, 0.97 * exact);
  EXPECT_LT(volume, exact);
}

TEST(CapsuleMesh, FacesOfFurtherCapsulesFollowTheFirst) {
  std::vector<Face> first, second;
  AppendCapsuleFaces(0, first);
  AppendCapsuleFaces(1000, second);
  ASSERT_EQ(first.size(), second.size());
  for (size_t f = 0; f < first.size(); ++f)
    for (size_t k = 0; k < 3; ++k) EXPECT_EQ(second[f][k], first[f][k] + 1000);
}

}  // namespace
}  // namespace weft
