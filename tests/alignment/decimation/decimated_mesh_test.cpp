#include "alignment/decimation/decimated_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace weft {
namespace {

using ::testing::HasSubstr;

TriangleMesh FlatSheet(int side) {
  TriangleMesh mesh;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) mesh.vertices_mm.emplace_back(3.0 * j, 3.0 * i, 0);
  for (int i = 0; i + 1 < side; ++i) {
    for (int j = 0; j + 1 < side; ++j) {
      const int v = i * side + j;
      mesh.faces.push_back({v, v + 1, v + side});
      mesh.faces.push_back({v + 1, v + side + 1, v + side});
    }
  }
  return mesh;
}

// A tube with two openings.
TriangleMesh Tube(int round, int tall) {
  TriangleMesh mesh;
  for (int i = 0; i < tall; ++i)
    for (int j = 0; j < round; ++j)
      mesh.vertices_mm.emplace_back(80 * std::cos(2 * M_PI * j / round), 80 * std::sin(2 * M_PI * j / round),
                                    3.0 * i);
  for (int i = 0; i + 1 < tall; ++i) {
    for (int j = 0; j < round; ++j) {
      const int a = i * round + j, b = i * round + (j + 1) % round;
      mesh.faces.push_back({a, b, a + round});
      mesh.faces.push_back({b, b + round, a + round});
    }
  }
  return mesh;
}

DecimatedMesh Decimated(const TriangleMesh& mesh, size_t max_vertices) {
  const absl::StatusOr<DecimatedMesh> fewer = DecimateMesh(mesh, max_vertices);
  EXPECT_TRUE(fewer.ok()) << fewer.status();
  return fewer.value_or(DecimatedMesh());
}

Eigen::Vector3d AreaVector(const TriangleMesh& mesh, const DecimatedMesh& fewer, const Face& face) {
  const auto at = [&](int corner) { return mesh.vertices_mm[fewer.vertices[face[corner]]]; };
  return 0.5 * (at(1) - at(0)).cross(at(2) - at(0));
}

// How many faces use an edge: edges of one face are those of openings.
std::map<std::pair<int, int>, int> EdgeUse(const std::vector<Face>& faces) {
  std::map<std::pair<int, int>, int> use;
  for (const Face& face : faces)
    for (int c = 0; c < 3; ++c) ++use[std::minmax(face[c], face[(c + 1) % 3])];
  return use;
}

TEST(DecimatedMesh, KeepsVerticesOfTheMeshInTheirOrder) {
  const TriangleMesh mesh = FlatSheet(60);
  const DecimatedMesh fewer = Decimated(mesh, 500);
  EXPECT_LE(fewer.vertices.size(), 500u);
  EXPECT_GT(fewer.vertices.size(), 400u) << "no more is left out than is asked";
  EXPECT_TRUE(std::is_sorted(fewer.vertices.begin(), fewer.vertices.end()));
  EXPECT_EQ(std::set<int>(fewer.vertices.begin(), fewer.vertices.end()).size(), fewer.vertices.size());
}

TEST(DecimatedMesh, IsEvenEvenWhereTheClothIsFlat) {
  const TriangleMesh mesh = FlatSheet(100);
  const DecimatedMesh fewer = Decimated(mesh, 1000);
  // Squares of 5 by 5 of them: ten vertices in each, were they spread perfectly.
  std::vector<int> in_square(100);
  for (const int v : fewer.vertices) {
    const Eigen::Vector3d& p = mesh.vertices_mm[v];
    ++in_square[static_cast<size_t>(p.y() / 30) * 10 + static_cast<size_t>(p.x() / 30)];
  }
  EXPECT_GE(*std::min_element(in_square.begin(), in_square.end()), 3);
  EXPECT_LE(*std::max_element(in_square.begin(), in_square.end()), 20);
}

TEST(DecimatedMesh, FacesCoverTheSheetOnceAndFaceAsBefore) {
  const TriangleMesh mesh = FlatSheet(60);
  const DecimatedMesh fewer = Decimated(mesh, 500);
  double area = 0;
  int turned = 0;
  for (const Face& face : fewer.faces) {
    const double z = AreaVector(mesh, fewer, face).z();
    area += z;
    turned += z < 0;
  }
  EXPECT_NEAR(area, 59 * 59 * 9, 0.05 * 59 * 59 * 9);
  EXPECT_EQ(turned, 0);
}

double SmallestAngleDegrees(const TriangleMesh& mesh, const DecimatedMesh& fewer, const Face& face) {
  double least = 180;
  for (int c = 0; c < 3; ++c) {
    const auto at = [&](int corner) { return mesh.vertices_mm[fewer.vertices[face[(c + corner) % 3]]]; };
    const Eigen::Vector3d p = at(1) - at(0), q = at(2) - at(0);
    least = std::min(least, std::atan2(p.cross(q).norm(), p.dot(q)) * 180 / M_PI);
  }
  return least;
}

// Folds whose sharpest place turns by 10 degrees a cell.
TEST(DecimatedMesh, FoldsOverNowhereAndHasFewSlivers) {
  TriangleMesh mesh = FlatSheet(70);
  for (Eigen::Vector3d& p : mesh.vertices_mm) p.z() = 10 * std::sin(p.x() / 12) + 5 * std::sin(p.y() / 20);
  const DecimatedMesh fewer = Decimated(mesh, 1500);
  std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>> normals;
  int slivers = 0;
  for (const Face& face : fewer.faces) {
    for (int c = 0; c < 3; ++c)
      normals[std::minmax(face[c], face[(c + 1) % 3])].push_back(AreaVector(mesh, fewer, face).normalized());
    slivers += SmallestAngleDegrees(mesh, fewer, face) < 15;
  }
  int folded = 0;
  for (const auto& [edge, sides] : normals) folded += sides.size() == 2 && sides[0].dot(sides[1]) < 0;
  EXPECT_EQ(folded, 0);
  EXPECT_LE(slivers, static_cast<int>(fewer.faces.size()) / 100);
}

TEST(DecimatedMesh, OpeningsStayOpenAndNothingElseOpens) {
  const TriangleMesh mesh = Tube(120, 80);
  const DecimatedMesh fewer = Decimated(mesh, 1500);
  int at_openings = 0;
  for (const auto& [edge, uses] : EdgeUse(fewer.faces)) {
    EXPECT_LE(uses, 2);
    if (uses == 2) continue;
    ++at_openings;
    for (const int v : {edge.first, edge.second}) {
      const double z = mesh.vertices_mm[fewer.vertices[v]].z();
      EXPECT_TRUE(z == 0 || z == 3.0 * 79) << z;
    }
  }
  EXPECT_GT(at_openings, 20);
}

TEST(DecimatedMesh, SmallMeshesStayAsTheyAre) {
  TriangleMesh mesh = FlatSheet(10);
  mesh.vertices_mm.emplace_back(500, 500, 500);  // of no face
  const DecimatedMesh fewer = Decimated(mesh, 100);
  EXPECT_EQ(fewer.vertices.size(), 100u);
  EXPECT_EQ(fewer.faces, mesh.faces);
}

TEST(DecimatedMesh, SaysWhatIsWrongWithAMesh) {
  TriangleMesh mesh = FlatSheet(10);
  EXPECT_THAT(DecimateMesh(mesh, 2).status().message(), HasSubstr("max_vertices"));
  EXPECT_THAT(DecimateMesh({mesh.vertices_mm, {}}, 10).status().message(), HasSubstr("no faces"));
  mesh.faces[3][1] = 100;
  EXPECT_THAT(DecimateMesh(mesh, 10).status().message(), HasSubstr("face 3: names vertex 100"));
  mesh = FlatSheet(10);
  mesh.vertices_mm[7].y() = std::numeric_limits<double>::infinity();
  EXPECT_THAT(DecimateMesh(mesh, 10).status().message(), HasSubstr("vertex 7"));
}

}  // namespace
}  // namespace weft
