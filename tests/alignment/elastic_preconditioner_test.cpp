#include "alignment/elastic_preconditioner.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

// Where all vertices are weakly held, the whole of W + stretch lambda L is factorised.
TEST(ElasticPreconditioner, InvertsTheGlobalStepOfWeaklyHeldVerticesAndLeavesFrozenOnes) {
  const TriangleMesh rest = testing::FlatSheet(12, 15);
  const MeshGraph graph = BuildMeshGraph(rest);
  const SlicedMesh slices = SliceMesh(rest, graph);
  constexpr double kWeight = 1e-3;
  ElasticProblem problem{rest.vertices_mm,
                         std::vector<Eigen::Matrix3d>(graph.vertices, kWeight * Eigen::Matrix3d::Identity()),
                         std::vector<bool>(graph.vertices, false)};
  for (int v = 0; v < 15; ++v) problem.frozen[v] = true;
  ElasticOptions options;
  options.lambda = 2;
  const auto preconditioner = ElasticPreconditioner::Build(slices, graph, problem, options);
  ASSERT_TRUE(preconditioner.ok()) << preconditioner.status();
  Field3 in, out;
  in.Resize(slices.degree.size());
  out.Resize(slices.degree.size());
  std::mt19937 random(4);
  std::normal_distribution<float> any;
  for (int v = 0; v < graph.vertices; ++v)
    in.x[v] = any(random), in.y[v] = any(random), in.z[v] = any(random);
  preconditioner->Apply(in, &out);
  const double edge = options.lambda * options.distortion.stretch;
  for (int v = 0; v < graph.vertices; ++v) {
    if (problem.frozen[v]) {
      EXPECT_EQ(out.y[v], 0);
      continue;
    }
    double back = (kWeight + edge * graph.degree(v)) * out.y[v];
    for (int i = graph.first[v]; i < graph.first[v + 1]; ++i) back -= edge * out.y[graph.neighbor[i]];
    EXPECT_NEAR(back, in.y[v], 1e-4);
  }
}

}  // namespace
}  // namespace weft
