#include "alignment/single_factor.h"

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

// The lower triangle of `weight` I + L, L the Laplacian of a sheet's graph.
Eigen::SparseMatrix<double> HeldSheet(const MeshGraph& graph, double weight) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int v = 0; v < graph.vertices; ++v) entries.emplace_back(v, v, weight + graph.degree(v));
  for (const MeshEdge& edge : graph.edges) entries.emplace_back(edge.b, edge.a, -1);
  Eigen::SparseMatrix<double> matrix(graph.vertices, graph.vertices);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

TEST(SingleFactor, SolvesAsDoublePrecisionDoes) {
  const MeshGraph graph = BuildMeshGraph(testing::FlatSheet(17, 12));
  const Eigen::SparseMatrix<double> matrix = HeldSheet(graph, 0.05);
  const auto factor = SingleFactor::Build(matrix);
  ASSERT_TRUE(factor.ok()) << factor.status();
  ASSERT_EQ(factor->size(), graph.vertices);
  const Eigen::MatrixX3d right = Eigen::MatrixX3d::Random(graph.vertices, 3);
  std::vector<Eigen::Vector4f> columns(graph.vertices);
  for (int i = 0; i < graph.vertices; ++i)
    columns[factor->place(i)] << right.row(i).transpose().cast<float>(), 0;
  factor->Solve(&columns);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> plain(matrix);
  const Eigen::MatrixX3d expected = plain.solve(right);
  for (int i = 0; i < graph.vertices; ++i) {
    const Eigen::Vector3d found = columns[factor->place(i)].head<3>().cast<double>();
    EXPECT_LT((found - expected.row(i).transpose()).norm(), 1e-5 * expected.norm()) << i;
  }
}

TEST(SingleFactor, TellsWhereAMatrixIsNotDefinite) {
  const MeshGraph graph = BuildMeshGraph(testing::FlatSheet(4, 4));
  Eigen::SparseMatrix<double> matrix = HeldSheet(graph, 0.05);
  matrix.coeffRef(0, 0) = 0, matrix.coeffRef(1, 0) = 0, matrix.coeffRef(4, 0) = 0, matrix.coeffRef(5, 0) = 0;
  EXPECT_EQ(SingleFactor::Build(matrix).status().code(), absl::StatusCode::kInternal);
}

}  // namespace
}  // namespace weft
