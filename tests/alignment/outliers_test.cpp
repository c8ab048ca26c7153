#include "alignment/outliers.h"

#include <gtest/gtest.h>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

TEST(Outliers, TargetsFarFromTheSurfaceGoAndThoseHalfWayAreWeakened) {
  const TriangleMesh rest = testing::FlatSheet(10, 10);
  const MeshGraph graph = BuildMeshGraph(rest);
  std::vector<VertexTarget> targets = testing::Measure(rest.vertices_mm, 0, 1);
  AlignOptions options;
  options.detection.weigh_by_sigma = false;
  const auto off_by = [&](int vertex, double ratio) {
    const double pulled =
        1 + 1 / (options.elastic.lambda * options.elastic.distortion.stretch * graph.degree(vertex));
    for (VertexTarget& t : targets)
      if (t.vertex == vertex) t.position_mm.z() += ratio * options.robust.min_distance_mm / pulled;
  };
  off_by(33, 1.1);
  off_by(55, 0.8);
  const std::vector<double> ratios = OutlierRatios(graph, targets, rest.vertices_mm, options);
  const std::vector<VertexTarget> kept = WithoutOutliers(targets, ratios, options.detection);
  ASSERT_EQ(kept.size(), targets.size() - 1);
  for (const VertexTarget& t : kept) {
    EXPECT_NE(t.vertex, 33);
    EXPECT_EQ(t.sigma_mm > 0, t.vertex == 55) << t.vertex;
  }
  EXPECT_TRUE(AreAllBut(targets, ratios, kept));
  EXPECT_FALSE(AreAllBut(targets, ratios, targets));
  EXPECT_FALSE(AreAllBut(targets, ratios, {kept.begin(), kept.end() - 1}));
}

}  // namespace
}  // namespace weft
