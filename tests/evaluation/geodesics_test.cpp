#include "evaluation/geodesics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "evaluation/geodesic_distortion.h"
#include "tests/evaluation/shapes.h"

namespace weft {
namespace {

std::vector<double> From(const TriangleMesh& mesh, int source) {
  const auto geodesics = GeodesicMesh::Build(mesh.vertices_mm, mesh.faces);
  EXPECT_TRUE(geodesics.ok()) << geodesics.status();
  return geodesics->DistancesFrom(source);
}

// Every face cut into four, once per level; new vertices come after the old ones.
TriangleMesh Subdivided(TriangleMesh mesh, int levels) {
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middle;
    const auto cut = [&](int a, int b) {
      const auto [at, is_new] =
          middle.try_emplace(std::minmax(a, b), static_cast<int>(mesh.vertices_mm.size()));
      if (is_new) mesh.vertices_mm.push_back((mesh.vertices_mm[a] + mesh.vertices_mm[b]) / 2);
      return at->second;
    };
    std::vector<Face> faces;
    for (const auto& [a, b, c] : mesh.faces) {
      const int ab = cut(a, b), bc = cut(b, c), ca = cut(c, a);
      for (const Face& face : {Face{a, ab, ca}, Face{ab, b, bc}, Face{ca, bc, c}, Face{ab, bc, ca}})
        faces.push_back(face);
    }
    mesh.faces = std::move(faces);
  }
  return mesh;
}

TriangleMesh Sphere(double radius_mm, int levels) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0}) mesh.vertices_mm.push_back(sign * Eigen::Vector3d::Unit(axis));
  mesh.faces = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    mesh = Subdivided(std::move(mesh), 1);
    for (auto& v : mesh.vertices_mm) v.normalize();
  }
  for (auto& v : mesh.vertices_mm) v *= radius_mm;
  return mesh;
}

TEST(GeodesicMesh, PlaneIsEuclid) {
  for (const double shuffle : {0.0, 0.3}) {
    const TriangleMesh sheet = Sheet(23, 31, 2.5, shuffle, Flat);
    for (const int source : {0, 15, 23 * 31 / 2, 23 * 31 - 1}) {
      const std::vector<double> found = From(sheet, source);
      for (size_t v = 0; v < found.size(); ++v)
        ASSERT_NEAR(found[v], (sheet.vertices_mm[v] - sheet.vertices_mm[source]).norm(), 1e-7)
            << source << " to " << v;
    }
  }
}

// Triangles of a rolled grid are flat pieces between straight lines of the cylinder, so the mesh unrolls to a
// sheet whose width is that of the chords.
TEST(GeodesicMesh, RolledSheetUnrolls) {
  constexpr double kStep = 2, kRadius = 20;
  const TriangleMesh tube = Sheet(20, 60, kStep, 0, Rolled(kRadius));  // 344 degrees around
  const double chord = 2 * kRadius * std::sin(kStep / kRadius / 2);
  for (const int source : {0, 7 * 60 + 31}) {
    const std::vector<double> found = From(tube, source);
    for (int v = 0; v < static_cast<int>(found.size()); ++v) {
      const double expected = std::hypot(chord * (v % 60 - source % 60), kStep * (v / 60 - source / 60));
      ASSERT_NEAR(found[v], expected, 1e-7) << source << " to " << v;
    }
  }
}

// A closed tube: the shorter way around.
TEST(GeodesicMesh, ClosedTubeTakesTheShorterWay) {
  constexpr int kAround = 40, kRows = 15;
  constexpr double kStep = 3;
  const double radius = kStep / 2 / std::sin(std::numbers::pi / kAround);
  TriangleMesh tube;
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kAround; ++c) {
      const double angle = 2 * std::numbers::pi * c / kAround;
      tube.vertices_mm.emplace_back(radius * std::sin(angle), kStep * r, radius * std::cos(angle));
      if (r == 0) continue;
      const int d = (c + 1) % kAround;
      tube.faces.push_back({(r - 1) * kAround + c, r * kAround + c, r * kAround + d});
      tube.faces.push_back({(r - 1) * kAround + c, r * kAround + d, (r - 1) * kAround + d});
    }
  const int source = 4 * kAround + 3;
  const std::vector<double> found = From(tube, source);
  for (int v = 0; v < kRows * kAround; ++v) {
    const int steps = std::abs(v % kAround - 3);
    const double expected = kStep * std::hypot(std::min(steps, kAround - steps), v / kAround - 4);
    ASSERT_NEAR(found[v], expected, 1e-7) << v;
  }
}

TEST(GeodesicMesh, SphereConverges) {
  constexpr double kRadius = 100;
  double error[2];
  for (const int level : {4, 5}) {
    const TriangleMesh sphere = Sphere(kRadius, level);
    const int source = 20;
    const std::vector<double> found = From(sphere, source);
    double worst = 0;
    for (size_t v = 0; v < found.size(); ++v) {
      const double cosine = sphere.vertices_mm[v].dot(sphere.vertices_mm[source]) / (kRadius * kRadius);
      worst = std::max(worst, std::abs(found[v] - kRadius * std::acos(std::clamp(cosine, -1.0, 1.0))));
    }
    error[level - 4] = worst;
  }
  EXPECT_LT(error[0], 1.0);             // of 314 mm
  EXPECT_LT(error[1], 0.3 * error[0]);  // quarters with the length of the edges squared
}

// Folds, saddles and a border: the distances are a metric, and cutting the faces changes nothing but adds
// vertices.
TEST(GeodesicMesh, CutFacesChangeNoDistance) {
  const auto hills = [](double x, double y) {
    return Eigen::Vector3d(x, y,
                           9 * std::sin(0.35 * x) * std::cos(0.3 * y) + 2 * std::sin(0.9 * x + 0.4 * y));
  };
  const TriangleMesh coarse = Sheet(18, 22, 2, 0.2, hills);
  const TriangleMesh fine = Subdivided(coarse, 2);
  for (const int source : {0, 200, 301}) {
    const std::vector<double> a = From(coarse, source), b = From(fine, source);
    for (size_t v = 0; v < a.size(); ++v) ASSERT_NEAR(a[v], b[v], 1e-6) << source << " to " << v;
    const std::vector<double> back = From(coarse, 117);
    EXPECT_NEAR(a[117], back[source], 1e-8);
  }
}

TEST(GeodesicMesh, OtherPiecesAreInfinitelyFar) {
  TriangleMesh two = Sheet(3, 3, 1, 0, Flat);
  const TriangleMesh other = Sheet(3, 3, 1, 0, [](double x, double y) { return Eigen::Vector3d(x, y, 10); });
  two.vertices_mm.insert(two.vertices_mm.end(), other.vertices_mm.begin(), other.vertices_mm.end());
  for (const Face& f : other.faces) two.faces.push_back({f[0] + 9, f[1] + 9, f[2] + 9});
  EXPECT_EQ(From(two, 0)[12], std::numeric_limits<double>::infinity());
}

TEST(GeodesicMesh, InvalidMeshesAreRefused) {
  TriangleMesh sheet = Sheet(3, 3, 1, 0, Flat);
  TriangleMesh wrong = sheet;
  wrong.faces[0][1] = 9;
  EXPECT_EQ(GeodesicMesh::Build(wrong.vertices_mm, wrong.faces).status().code(),
            absl::StatusCode::kInvalidArgument);
  wrong = sheet;
  wrong.vertices_mm[4].x() = std::nan("");
  EXPECT_EQ(GeodesicMesh::Build(wrong.vertices_mm, wrong.faces).status().code(),
            absl::StatusCode::kInvalidArgument);
  wrong = sheet;
  wrong.faces.push_back({0, 1, 4}), wrong.faces.push_back({0, 1, 5});
  EXPECT_EQ(GeodesicMesh::Build(wrong.vertices_mm, wrong.faces).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
