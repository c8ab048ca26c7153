#include "alignment/untangle/contact_planes.h"

#include <gtest/gtest.h>

#include <limits>
#include "alignment/untangle/closest_points.h"
#include "alignment/untangle/cut_off_regions.h"
#include "alignment/untangle/self_intersection.h"
#include "tests/alignment/untangle/intersecting_sheets.h"

namespace weft {
namespace {

using testing::FlatSheet;
using testing::WholeMesh;

class RandomPoints {
 public:
  explicit RandomPoints(uint32_t seed) : random_(seed) {}
  Eigen::Vector3d Next() { return {unit_(random_), unit_(random_), unit_(random_)}; }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> unit_{-1, 1};
};

// Against all points of a fine raster.
TEST(ClosestPoints, OfATriangleAreTheNearestOfAll) {
  RandomPoints points(3);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p = points.Next(), a = points.Next(), b = points.Next(), c = points.Next();
    double nearest = std::numeric_limits<double>::infinity();
    for (int u = 0; u <= 60; ++u) {
      for (int v = 0; u + v <= 60; ++v) {
        nearest = std::min(nearest, ((60 - u - v) * a + u * b + v * c - 60 * p).norm() / 60);
      }
    }
    const Eigen::Vector3d shares = ClosestOnTriangle(p, a, b, c);
    EXPECT_NEAR(shares.sum(), 1, 1e-12);
    EXPECT_GE(shares.minCoeff(), 0);
    const double distance = (shares[0] * a + shares[1] * b + shares[2] * c - p).norm();
    EXPECT_LE(distance, nearest + 1e-12);
    EXPECT_GT(distance, nearest - 0.05);
  }
}

TEST(ClosestPoints, OfSegmentsAreTheNearestOfAll) {
  RandomPoints points(4);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d a = points.Next(), b = points.Next(), c = points.Next();
    const Eigen::Vector3d d =
        i % 3 == 0 ? Eigen::Vector3d(c + 0.7 * (b - a)) : points.Next();  // parallel ones too
    double nearest = std::numeric_limits<double>::infinity();
    for (int u = 0; u <= 60; ++u) {
      for (int v = 0; v <= 60; ++v) {
        nearest = std::min(nearest, ((60 - u) * a + u * b - (60 - v) * c - v * d).norm() / 60);
      }
    }
    const Eigen::Vector2d at = ClosestOnSegments(a, b, c, d);
    const double distance = (a + at[0] * (b - a) - c - at[1] * (d - c)).norm();
    EXPECT_LE(distance, nearest + 1e-12);
    EXPECT_GT(distance, nearest - 0.05);
  }
}

TEST(ClosestPoints, TakeSidesWithoutLength) {
  const Eigen::Vector3d p(1, 2, 3), q(4, 6, 3);
  const Eigen::Vector2d at = ClosestOnSegments(p, p, q, q);
  EXPECT_TRUE(at.allFinite());
  const Eigen::Vector3d shares = ClosestOnTriangle(p, q, q, q);
  EXPECT_TRUE(shares.allFinite());
  EXPECT_NEAR(shares.sum(), 1, 1e-12);
}

// The greatest move towards `wish` that the planes leave.
Eigen::Vector3d Within(const ContactPlanes& contacts, int v, Eigen::Vector3d wish, double max_mm) {
  double share = std::min(1.0, max_mm / wish.norm());
  for (int i = contacts.first[v]; i < contacts.first[v + 1]; ++i) {
    const double against = -contacts.planes[i].normal.dot(wish),
                 room = std::max(contacts.planes[i].room_mm, 0.0);
    if (against > room) share = std::min(share, room / against);
  }
  return share * wish;
}

// Two wavy layers half a millimetre apart, everything driven about at random and as far as it may.
TEST(ContactPlanes, KeepACrowdFromPassingThroughItself) {
  TriangleMesh mesh = testing::Joined(FlatSheet(14, 14), FlatSheet(14, 14));
  for (size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    Eigen::Vector3d& p = mesh.vertices_mm[v];
    p.z() = 1.5 * std::sin(p.x() / 3) * std::cos(p.y() / 4) + (v < mesh.vertices_mm.size() / 2 ? 0 : 0.5);
  }
  UntanglePatch patch = WholeMesh(mesh);
  ASSERT_TRUE(FindPiercings(patch).empty());
  RandomPoints points(5);
  const double reach_mm = 1.2;
  double moved_mm = 0;
  for (int step = 0; step < 60; ++step) {
    const ContactPlanes contacts =
        FindContactPlanes(patch, std::vector<bool>(patch.vertex.size(), true), reach_mm, 0.01);
    for (int v = 0; v < patch.free; ++v) {
      const Eigen::Vector3d move = Within(contacts, v, 3 * points.Next(), reach_mm / 2);
      patch.position_mm[v] += move;
      moved_mm += move.norm() / patch.free;
    }
    ASSERT_TRUE(FindIntersectingPairs(patch.position_mm, patch.faces).empty()) << "step " << step;
  }
  EXPECT_GT(moved_mm, 5);
}

TEST(ContactPlanes, AskLayersThatAreTooNearToPart) {
  const TriangleMesh below = FlatSheet(4, 4);
  TriangleMesh above = below;
  for (Eigen::Vector3d& v : above.vertices_mm) v += Eigen::Vector3d(0.9, 0.7, 0.03);
  const UntanglePatch patch = WholeMesh(testing::Joined(below, above));
  const ContactPlanes contacts =
      FindContactPlanes(patch, std::vector<bool>(patch.vertex.size(), true), 0.5, 0.05);
  int asking = 0;
  for (const ContactPlane& plane : contacts.planes) {
    if (plane.room_mm >= 0) continue;
    ++asking;
    EXPECT_NEAR(plane.normal.z(), plane.vertex < 16 ? -1 : 1, 1e-9);
    EXPECT_NEAR(plane.room_mm, -0.01, 1e-9);
  }
  EXPECT_GT(asking, 50);
}

TEST(ContactPlanes, KnowWhatIsOnTheOtherSide) {
  TriangleMesh above = FlatSheet(4, 4);
  for (Eigen::Vector3d& v : above.vertices_mm) v += Eigen::Vector3d(0.9, 0.7, 0.2);
  const UntanglePatch patch = WholeMesh(testing::Joined(FlatSheet(4, 4), above));
  const ContactPlanes contacts =
      FindContactPlanes(patch, std::vector<bool>(patch.vertex.size(), true), 0.5, 0.05);
  ASSERT_GT(contacts.planes.size(), 50u);
  for (const ContactPlane& plane : contacts.planes) {
    const std::span<const int> opposite = contacts.contacts[plane.contact].Opposite(plane.vertex);
    EXPECT_GE(opposite.size(), 1u);
    EXPECT_LE(opposite.size(), 3u);
    for (const int v : opposite) EXPECT_NE(v < 16, plane.vertex < 16);
  }
}

}  // namespace
}  // namespace weft
