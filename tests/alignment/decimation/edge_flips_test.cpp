#include "alignment/decimation/edge_flips.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace weft {
namespace {

using Points = std::vector<Eigen::Vector3d>;
using Places = std::vector<Eigen::Vector2f>;

std::set<std::set<int>> SetsOf(const std::vector<Face>& faces) {
  std::set<std::set<int>> sets;
  for (const Face& face : faces) sets.insert({face.begin(), face.end()});
  return sets;
}

// Two slivers along the long diagonal of a kite: 0 and 1 are its ends.
const Points kKite = {{0, 0, 0}, {20, 0, 0}, {10, 2, 0}, {10, -2, 0}};
const std::vector<Face> kSlivers = {{0, 1, 2}, {1, 0, 3}};

TEST(FlipBadEdges, MendsSliversAndKeepsTheSideThatFacesUp) {
  std::vector<Face> faces = kSlivers;
  FlipBadEdges(kKite, {}, faces);
  EXPECT_EQ(SetsOf(faces), (std::set<std::set<int>>{{0, 2, 3}, {1, 2, 3}}));
  for (const Face& face : faces) {
    const Eigen::Vector3d b = kKite[face[1]] - kKite[face[0]], c = kKite[face[2]] - kKite[face[0]];
    EXPECT_GT(b.x() * c.y() - b.y() * c.x(), 0);
  }
}

TEST(FlipBadEdges, LeavesGoodFacesAlone) {
  const Points points = {{0, 0, 0}, {10, 0, 0}, {5, 4, 0}, {5, -4, 0}};  // 38.7 degrees; flipped 77
  std::vector<Face> faces = kSlivers;
  FlipBadEdges(points, {}, faces);
  EXPECT_EQ(faces, kSlivers);
}

TEST(FlipBadEdges, UnfoldsWhereAFaceLiesOnItsNeighbour) {
  // 3 lies inside the triangle above it: not convex, so 1, 0, 3 lies upside down on 0, 1, 2. All is flat
  // with the edge from 2 to 3.
  const Points points = {{0, 0, 0}, {10, 0, 0}, {4, 8, 0}, {5, 3, 0}};
  std::vector<Face> faces = {{0, 1, 2}, {1, 0, 3}};
  FlipBadEdges(points, {}, faces);
  EXPECT_EQ(SetsOf(faces), (std::set<std::set<int>>{{0, 2, 3}, {1, 2, 3}}));
}

TEST(FlipBadEdges, LeavesSeamsWhereTheyAre) {
  Points points = kKite;
  points.push_back(points[0]);
  points.push_back(points[1]);
  const std::vector<Face> across = {{0, 1, 2}, {5, 4, 3}};
  std::vector<Face> faces = across;
  FlipBadEdges(points, {}, faces);
  EXPECT_EQ(faces, across);
}

TEST(FlipBadEdges, MakesNoEdgeTwice) {
  // A flat tetrahedron: 2 and 3 have an edge already.
  std::vector<Face> faces = {{0, 1, 2}, {1, 0, 3}, {0, 2, 3}, {2, 1, 3}};
  const std::vector<Face> before = faces;
  FlipBadEdges(kKite, {}, faces);
  EXPECT_EQ(faces, before);
}

TEST(FlipBadEdges, TurnsNoFaceOverOnThePrint) {
  std::vector<Face> faces = kSlivers;
  // On the print 0 lies between 2, 3 and 1: no convex quad.
  FlipBadEdges(kKite, Places{{14, 0}, {20, 0}, {10, 8}, {10, -8}}, faces);
  EXPECT_EQ(faces, kSlivers);
  FlipBadEdges(kKite, Places{{0, 0}, {20, 0}, {10, 2}, {10, -2}}, faces);
  EXPECT_NE(faces, kSlivers);
}

}  // namespace
}  // namespace weft
