#include "alignment/mesh_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "alignment/fill.h"
#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using testing::FlatSheet;
using ::testing::Ge;
using testing::kCellMm;

TEST(MeshGraph, CountsEdgesAsEulerDoes) {
  const TriangleMesh mesh = FlatSheet(7, 9);
  const MeshGraph graph = BuildMeshGraph(mesh);
  EXPECT_EQ(graph.vertices - static_cast<int>(graph.edges.size()) + static_cast<int>(mesh.faces.size()), 1);
  EXPECT_EQ(graph.components, 1);
  EXPECT_EQ(graph.neighbor.size(), 2 * graph.edges.size());
}

// In squares cut along a diagonal the angles opposite the sides are 45 degrees, those opposite the
// diagonal 90.
TEST(MeshGraph, WeighsEdgesByHalfTheSumOfTheOppositeCotangents) {
  const MeshGraph graph = BuildMeshGraph(FlatSheet(3, 3));
  const auto weight = [&](int a, int b) {
    for (int i = graph.first[a]; i < graph.first[a + 1]; ++i) {
      if (graph.neighbor[i] == b) return graph.cotan_weight[i];
    }
    return -1.0f;
  };
  EXPECT_FLOAT_EQ(weight(4, 1), 1);     // inner side: 45 degrees on both sides
  EXPECT_FLOAT_EQ(weight(1, 4), 1);     // from either end
  EXPECT_FLOAT_EQ(weight(0, 1), 0.5);   // border side: one triangle
  EXPECT_NEAR(weight(0, 4), 0, 0.011);  // diagonal: cot 90 degrees, raised to a hundredth of the median
  EXPECT_GT(weight(0, 4), 0);
}

TEST(MeshGraph, TellsComponentsAndIsolatedVerticesApart) {
  TriangleMesh mesh = FlatSheet(2, 2);
  mesh.vertices_mm.emplace_back(100, 0, 0);  // alone
  const int shift = static_cast<int>(mesh.vertices_mm.size());
  for (const Eigen::Vector3d& v : FlatSheet(2, 2).vertices_mm) mesh.vertices_mm.push_back(v);
  mesh.faces.push_back({shift, shift + 1, shift + 2});
  mesh.faces.push_back({shift + 1, shift + 3, shift + 2});
  const MeshGraph graph = BuildMeshGraph(mesh);
  EXPECT_EQ(graph.components, 3);
  EXPECT_THAT(graph.component, ElementsAre(0, 0, 0, 0, 1, 2, 2, 2, 2));
  EXPECT_EQ(graph.degree(4), 0);
}

TEST(MeshGraph, KeepsWeightsOfTrianglesWithoutAreaFinite) {
  TriangleMesh mesh;
  mesh.vertices_mm = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 0, 0}};
  mesh.faces = {{0, 1, 2}, {1, 2, 3}};
  const MeshGraph graph = BuildMeshGraph(mesh);
  EXPECT_THAT(graph.cotan_weight, Each(Ge(1e-6f)));
  EXPECT_THAT(graph.cotan_weight, Each(::testing::Lt(std::numeric_limits<float>::infinity())));
}

TEST(RingDistance, CountsEdgesToTheNearestSource) {
  const MeshGraph graph = BuildMeshGraph(FlatSheet(1, 1));
  EXPECT_THAT(RingDistance(graph, {false}), ElementsAre(-1));
  const MeshGraph strip = BuildMeshGraph(FlatSheet(2, 4));
  std::vector<bool> source(8, false);
  source[0] = source[4] = true;
  EXPECT_THAT(RingDistance(strip, source), ElementsAre(0, 1, 2, 3, 0, 1, 2, 3));
}

// Linear functions are harmonic for cotangent weights on a flat mesh.
TEST(LaplacianFill, ReproducesLinearFunctionsOnAFlatSheet) {
  const int rows = 12, cols = 15;
  const TriangleMesh mesh = FlatSheet(rows, cols);
  const MeshGraph graph = BuildMeshGraph(mesh);
  Eigen::Matrix3d linear;
  linear << 1, 0.2, 0, -0.3, 2, 0, 0.7, -0.1, 0;
  std::vector<Eigen::Vector3d> values(mesh.vertices_mm.size(), Eigen::Vector3d::Constant(1e6));
  std::vector<bool> known(values.size(), false);
  for (int v = 0; v < graph.vertices; ++v) {
    const int r = v / cols, c = v % cols;
    if (r > 0 && c > 0 && r + 1 < rows && c + 1 < cols) continue;
    known[v] = true;
    values[v] = linear * mesh.vertices_mm[v];
  }
  ASSERT_TRUE(LaplacianFill(graph, known, &values).ok());
  for (int v = 0; v < graph.vertices; ++v) {
    EXPECT_LT((values[v] - linear * mesh.vertices_mm[v]).norm(), 1e-3 * kCellMm) << v;
  }
}

TEST(LaplacianFill, LeavesComponentsWithoutAnyKnownVertexAlone) {
  const TriangleMesh mesh = FlatSheet(3, 3);
  std::vector<Eigen::Vector3d> values = mesh.vertices_mm;
  ASSERT_TRUE(LaplacianFill(BuildMeshGraph(mesh), std::vector<bool>(9, false), &values).ok());
  EXPECT_EQ(values, mesh.vertices_mm);
}

}  // namespace
}  // namespace weft
