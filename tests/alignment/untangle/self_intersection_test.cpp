#include "alignment/untangle/self_intersection.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/LU>
#include <algorithm>
#include <random>

#include "tests/alignment/untangle/intersecting_sheets.h"

namespace weft {
namespace {

using testing::FlatSheet;
using testing::SomeMotion;
using Triangle = Eigen::Vector3d[3];

const Triangle kBase = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};

// In several places and orders; the answer is the same.
bool Intersects(const Triangle& s, const Triangle& t) {
  const bool answer = TrianglesIntersect(s, t);
  for (int turn = 0; turn < 3; ++turn) {
    Triangle moved_s, moved_t;
    for (int i = 0; i < 3; ++i) {
      moved_s[i] = s[(i + turn) % 3] + Eigen::Vector3d(8, -32, 64);
      moved_t[i] = t[(2 * i + turn) % 3] + Eigen::Vector3d(8, -32, 64);
    }
    EXPECT_EQ(TrianglesIntersect(moved_s, moved_t), answer);
    EXPECT_EQ(TrianglesIntersect(moved_t, moved_s), answer);
  }
  return answer;
}

TEST(TrianglesIntersect, SeesAnEdgeThatPierces) {
  EXPECT_TRUE(Intersects(kBase, {{1, 1, -1}, {1, 1, 1}, {9, 9, 5}}));
  EXPECT_FALSE(Intersects(kBase, {{3, 3, -1}, {3, 3, 1}, {9, 9, 5}}));  // passes beside the long side
}

TEST(TrianglesIntersect, SeesTwoTrianglesThatCutEachOther) {
  EXPECT_TRUE(Intersects(kBase, {{1, -1, -1}, {1, -1, 1}, {1, 1, 0}}));
}

TEST(TrianglesIntersect, ParallelPlanesNeverMeet) {
  EXPECT_FALSE(Intersects(kBase, {{0, 0, 1e-9}, {4, 0, 1e-9}, {0, 4, 1e-9}}));
}

TEST(TrianglesIntersect, TouchingCounts) {
  EXPECT_TRUE(Intersects(kBase, {{1, 1, 0}, {1, 1, 3}, {2, 1, 3}}));            // a corner on the face
  EXPECT_FALSE(Intersects(kBase, {{1, 1, 1.0 / 1024}, {1, 1, 3}, {2, 1, 3}}));  // just above
  EXPECT_TRUE(Intersects(kBase, {{2, 0, 0}, {2, -1, 3}, {2, -1, -3}}));         // a corner on a side
  EXPECT_TRUE(Intersects(kBase, {{0, 0, 0}, {-1, -1, 3}, {-1, -2, 3}}));        // a corner on a corner
}

TEST(TrianglesIntersect, HandlesACommonPlane) {
  EXPECT_TRUE(Intersects(kBase, {{1, 1, 0}, {9, 1, 0}, {1, 9, 0}}));          // overlap
  EXPECT_TRUE(Intersects(kBase, {{0.5, 0.5, 0}, {1, 0.5, 0}, {0.5, 1, 0}}));  // one inside the other
  EXPECT_FALSE(Intersects(kBase, {{3, 3, 0}, {5, 3, 0}, {3, 5, 0}}));         // boxes overlap only
  EXPECT_FALSE(Intersects(kBase, {{-3, -3, 0}, {-1, -3, 0}, {-1, -1, 0}}));
}

TEST(TrianglesIntersect, TakesTrianglesWithoutAreaForSegmentsAndPoints) {
  EXPECT_TRUE(Intersects(kBase, {{1, 1, -1}, {1, 1, 0.5}, {1, 1, 1}}));
  EXPECT_FALSE(Intersects(kBase, {{3, 3, -1}, {3, 3, 0.5}, {3, 3, 1}}));
  EXPECT_TRUE(Intersects(kBase, {{1, 1, 0}, {1, 1, 0}, {1, 1, 0}}));
  EXPECT_FALSE(Intersects(kBase, {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}));
}

// Against an independent criterion: triangles in general position meet where an edge of one pierces the
// other, which the signs of determinants tell.
bool Pierces(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Triangle& t) {
  const auto side = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d) {
    Eigen::Matrix3d m;
    m << b - a, c - a, d - a;
    return m.determinant() > 0;
  };
  if (side(t[0], t[1], t[2], p) == side(t[0], t[1], t[2], q)) return false;
  const bool first = side(p, q, t[0], t[1]);
  return first == side(p, q, t[1], t[2]) && first == side(p, q, t[2], t[0]);
}

TEST(TrianglesIntersect, AgreesWithPiercingEdgesOnRandomTriangles) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  int meeting = 0;
  for (int i = 0; i < 20000; ++i) {
    Triangle s, t;
    for (int k = 0; k < 3; ++k) {
      s[k] = {unit(random), unit(random), unit(random)};
      t[k] = {unit(random), unit(random), unit(random)};
    }
    bool pierces = false;
    for (int k = 0; k < 3; ++k) {
      pierces |= Pierces(s[k], s[(k + 1) % 3], t) || Pierces(t[k], t[(k + 1) % 3], s);
    }
    ASSERT_EQ(TrianglesIntersect(s, t), pierces) << i;
    meeting += pierces;
  }
  EXPECT_GT(meeting, 2000);
}

// A second sheet across the first, in the plane x = 10.3: it cuts the row of squares that holds this line.
TriangleMesh CrossedSheets(int cells) {
  TriangleMesh mesh = FlatSheet(cells + 1, cells + 1);
  const int base = static_cast<int>(mesh.vertices_mm.size());
  const TriangleMesh flat = FlatSheet(cells + 1, cells + 1);
  for (const Eigen::Vector3d& v : flat.vertices_mm) {
    mesh.vertices_mm.emplace_back(10.3, v.y() + 0.01, v.x() - 0.5 * cells * testing::kCellMm + 0.2);
  }
  for (const Face& f : flat.faces) mesh.faces.push_back({f[0] + base, f[1] + base, f[2] + base});
  return mesh;
}

std::vector<FacePair> AllPairs(const TriangleMesh& mesh) {
  std::vector<FacePair> pairs;
  const auto corners = [&](int f, Triangle& t) {
    for (int i = 0; i < 3; ++i) t[i] = mesh.vertices_mm[mesh.faces[f][i]];
  };
  for (int a = 0; a < static_cast<int>(mesh.faces.size()); ++a) {
    for (int b = a + 1; b < static_cast<int>(mesh.faces.size()); ++b) {
      Triangle s, t;
      corners(a, s);
      corners(b, t);
      bool shared = false;
      for (const int v : mesh.faces[a]) {
        for (const int w : mesh.faces[b]) shared |= v == w;
      }
      if (!shared && TrianglesIntersect(s, t)) pairs.push_back({a, b});
    }
  }
  return pairs;
}

TEST(FindSelfIntersections, FindsWhatComparingAllPairsFinds) {
  TriangleMesh mesh = CrossedSheets(12);
  for (Eigen::Vector3d& v : mesh.vertices_mm) v = SomeMotion() * v;
  const std::vector<FacePair> pairs = FindSelfIntersections(mesh.vertices_mm, mesh.faces);
  EXPECT_GE(pairs.size(), 24u);
  EXPECT_EQ(pairs, AllPairs(mesh));
}

TEST(FindSelfIntersections, IgnoresNeighboursAndFoldsThatDoNotTouch) {
  TriangleMesh mesh = FlatSheet(20, 20);
  EXPECT_TRUE(FindSelfIntersections(mesh.vertices_mm, mesh.faces).empty());
  // Rolled up tightly, the layers half a millimetre apart.
  for (Eigen::Vector3d& v : mesh.vertices_mm) {
    const double radius = 5 + 0.5 * v.x() / 35, angle = v.x() / 5;
    v = {radius * std::cos(angle), v.y(), radius * std::sin(angle)};
  }
  EXPECT_TRUE(FindSelfIntersections(mesh.vertices_mm, mesh.faces).empty());
}

TEST(FindSelfIntersections, SurvivesAVertexThatFliesAway) {
  TriangleMesh mesh = CrossedSheets(6);
  mesh.vertices_mm[0] = {1e7, -1e7, 1e7};
  EXPECT_EQ(FindSelfIntersections(mesh.vertices_mm, mesh.faces), AllPairs(mesh));
}

TEST(FindSelfIntersections, SameAtAnyThreadCount) {
  const TriangleMesh mesh = CrossedSheets(80);
  const auto run = [&](int threads) {
    return tbb::task_arena(threads).execute(
        [&] { return FindSelfIntersections(mesh.vertices_mm, mesh.faces); });
  };
  const auto one = run(1);
  EXPECT_GE(one.size(), 160u);
  EXPECT_EQ(one, run(2));
}

TEST(FindIntersectingPairs, FindsFacesThatMeetAroundAVertex) {
  TriangleMesh mesh = testing::FacesThroughEachOtherAtAVertex();
  EXPECT_TRUE(FindSelfIntersections(mesh.vertices_mm, mesh.faces).empty());
  const IntersectingPairs found = FindIntersectingPairs(mesh.vertices_mm, mesh.faces);
  EXPECT_TRUE(found.apart.empty());
  EXPECT_EQ(found.at_vertex, (std::vector<FacePair>{{0, 1}}));
  mesh.vertices_mm[4].z() = 0.5;  // ends above the other face
  EXPECT_TRUE(FindIntersectingPairs(mesh.vertices_mm, mesh.faces).empty());
}

// Every pair with one vertex in common, in random fans.
TEST(FindIntersectingPairs, AgreesWithPiercingSidesAroundAVertex) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  int meeting = 0;
  for (int i = 0; i < 5000; ++i) {
    TriangleMesh mesh{{{0, 0, 0}}, {{1, 0, 2}, {3, 4, 0}}};
    for (int v = 0; v < 4; ++v) mesh.vertices_mm.emplace_back(unit(random), unit(random), 0.3 * unit(random));
    const auto& p = mesh.vertices_mm;
    const Triangle s = {p[1], p[0], p[2]}, t = {p[3], p[4], p[0]};
    const bool meet = Pierces(p[1], p[2], t) || Pierces(p[3], p[4], s);
    ASSERT_EQ(FindIntersectingPairs(p, mesh.faces).at_vertex.size(), meet ? 1u : 0u) << i;
    meeting += meet;
  }
  EXPECT_GT(meeting, 500);
}

TEST(FindIntersectingPairs, SeesWhatMeetsOnceRoundedToFloats) {
  TriangleMesh mesh;
  for (const Eigen::Vector3d& corner : kBase)
    mesh.vertices_mm.push_back(corner + Eigen::Vector3d(0, 0, 4096));
  // Above by less than half the distance between floats there.
  for (const Eigen::Vector3d& corner : kBase) {
    mesh.vertices_mm.push_back(corner + Eigen::Vector3d(0.5, 0.5, 4096 + 1e-5));
  }
  mesh.faces = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_TRUE(FindSelfIntersections(mesh.vertices_mm, mesh.faces).empty());
  EXPECT_EQ(FindIntersectingPairs(mesh.vertices_mm, mesh.faces).apart.size(), 1u);
}

TEST(FindIntersectingPairs, FindsWhatFindSelfIntersectionsFinds) {
  TriangleMesh mesh = CrossedSheets(12);
  for (Eigen::Vector3d& v : mesh.vertices_mm) v = SomeMotion() * v;
  const IntersectingPairs found = FindIntersectingPairs(mesh.vertices_mm, mesh.faces);
  EXPECT_EQ(found.apart, AllPairs(mesh));
  EXPECT_TRUE(found.at_vertex.empty());
}

// Of a few vertices, so that pairs come, go and stay, with and without a common vertex.
TEST(FindIntersectingPairs, SearchingAgainFindsWhatSearchingAllFinds) {
  std::mt19937 random(11);
  std::normal_distribution<double> move_mm(0, 3);
  TriangleMesh mesh = CrossedSheets(12);
  IntersectingPairs found = FindIntersectingPairs(mesh.vertices_mm, mesh.faces);
  size_t at_vertex = 0, kept = 0;
  for (int i = 0; i < 20; ++i) {
    std::vector<bool> moved(mesh.vertices_mm.size(), false);
    for (int k = 0; k < 12; ++k) {
      const size_t v = random() % mesh.vertices_mm.size();
      mesh.vertices_mm[v] += Eigen::Vector3d(move_mm(random), move_mm(random), move_mm(random));
      moved[v] = true;
    }
    const IntersectingPairs again = FindIntersectingPairsAgain(mesh.vertices_mm, mesh.faces, found, moved);
    const IntersectingPairs all = FindIntersectingPairs(mesh.vertices_mm, mesh.faces);
    ASSERT_EQ(again.apart, all.apart) << i;
    ASSERT_EQ(again.at_vertex, all.at_vertex) << i;
    for (const FacePair& pair : found.apart)
      kept += std::binary_search(again.apart.begin(), again.apart.end(), pair);
    at_vertex += again.at_vertex.size();
    found = again;
  }
  EXPECT_GT(at_vertex, 0u);
  EXPECT_GT(kept, 100u);
}

TEST(FindSelfIntersections, MeshesWithoutFacesHaveNone) {
  EXPECT_TRUE(FindSelfIntersections({}, {}).empty());
}

}  // namespace
}  // namespace weft
