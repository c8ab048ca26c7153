#include "animation/paper/graph_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "alignment/mesh_graph.h"
#include "alignment/placement.h"
#include "base/counter_random.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

class GraphFitTest : public testing::Test {
 protected:
  GraphFitTest() {
    GraphOptions options;
    options.nodes = 40;
    graph_ = *BuildDeformationGraph(rest_, BuildMeshGraph(rest_), options);
  }
  double LeftMm(const std::vector<Eigen::Vector3d>& mesh, const GraphFitOptions& options = {}) const {
    GraphFit fit(graph_, options);
    return MeanDistance(SkinnedMesh(graph_, *fit.Fit(mesh)), mesh);
  }

  TriangleMesh rest_ = WavingTube::Garment().rest;
  DeformationGraph graph_;
};

TEST_F(GraphFitTest, AMeshThatMovedRigidlyIsMet) {
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3d& p : rest_.vertices_mm)
    moved.push_back(Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, 1, 0).normalized()) * p +
                    Eigen::Vector3d(400, 0, -80));
  EXPECT_LT(LeftMm(moved), 1e-6);
}

TEST_F(GraphFitTest, AMeshThatTheGraphMakesIsMet) {
  GraphPose pose = GraphPose::Zero(6, graph_.nodes());
  for (int i = 1; i < graph_.nodes(); ++i)
    for (int k = 0; k < 6; ++k)
      pose(k, i) = (k < 3 ? 0.08 : 2) * NormalOf(9, static_cast<uint64_t>(6 * i + k));
  const auto mesh = SkinnedMesh(graph_, PlaceNodes(graph_, Eigen::Isometry3d::Identity(), pose));
  GraphFitOptions options;
  options.distortion = 1e-5;
  options.max_steps = 30;
  options.tolerance_mm = 0;
  EXPECT_LT(LeftMm(mesh, options), 0.05);
}

TEST_F(GraphFitTest, ABentTubeIsMetAsWellAsBendsBetweenNodesAllow) {
  const auto bent = WavingTube::Shape(1.2, 0.6, 0);
  // Nodes are 115 mm apart on a tube of 640 mm that bends by 69 degrees: rigid, it would be off by more.
  const Eigen::Isometry3d motion = RigidFit(rest_.vertices_mm, bent);
  double rigid = 0;
  for (size_t v = 0; v < bent.size(); ++v)
    rigid += (motion * rest_.vertices_mm[v] - bent[v]).norm() / static_cast<double>(bent.size());
  EXPECT_GT(rigid, 30);
  EXPECT_LT(LeftMm(bent), 0.15 * rigid);
}

TEST_F(GraphFitTest, AWarmStartNeedsNoMoreThanAStep) {
  GraphFitOptions options;
  options.max_steps = 30;
  options.tolerance_mm = 1e-6;
  GraphFit fit(graph_, options);
  const auto bent = WavingTube::Shape(0.8, 0.3, 0);
  const auto motions = *fit.Fit(bent);
  options.max_steps = 1;
  GraphFit once(graph_, options);
  EXPECT_LT(MeanDistance(SkinnedMesh(graph_, *once.Fit(bent, motions)), SkinnedMesh(graph_, motions)), 1e-4);
}

TEST_F(GraphFitTest, StrongDistortionKeepsNodesTogether) {
  GraphFitOptions stiff;
  stiff.distortion = 1e6;
  const auto bent = WavingTube::Shape(1.2, 0.6, 0);
  EXPECT_GT(LeftMm(bent, stiff), 5 * LeftMm(bent));
}

TEST_F(GraphFitTest, RefusesOtherMeshes) {
  GraphFit fit(graph_, {});
  std::vector<Eigen::Vector3d> mesh = rest_.vertices_mm;
  mesh.pop_back();
  EXPECT_EQ(fit.Fit(mesh).status().code(), absl::StatusCode::kInvalidArgument);
  mesh.emplace_back(0, std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_EQ(fit.Fit(mesh).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(GraphFitTest, MotionsStayAsTheyAre) {
  Recorded recorded;
  for (const double distortion : {0.02, 1.0}) {
    GraphFitOptions options;
    options.distortion = distortion;
    options.max_steps = 3;
    GraphFit fit(graph_, options);
    const auto first = *fit.Fit(WavingTube::Shape(0.6, 0.3, 0.02));
    recorded.Add("first", first);
    recorded.Add("next", *fit.Fit(WavingTube::Shape(0.7, 0.2, 0.01), first));
  }
  recorded.Expect();
}

TEST_F(GraphFitTest, EndsWhereNoNodeMovesFurther) {
  GraphFitOptions options;
  options.tolerance_mm = 1e9;
  GraphFit fit(graph_, options);
  options.tolerance_mm = 0;
  options.max_steps = 1;
  GraphFit once(graph_, options);
  const auto bent = WavingTube::Shape(0.8, 0.3, 0);
  const auto a = *fit.Fit(bent), b = *once.Fit(bent);
  for (size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].matrix(), b[i].matrix());
}

TEST_F(GraphFitTest, SaysWhatIsWrongWithAMesh) {
  GraphFit fit(graph_, {});
  std::vector<Eigen::Vector3d> mesh = rest_.vertices_mm;
  mesh.pop_back();
  EXPECT_EQ(fit.Fit(mesh).status().message(), "graph fit: the mesh has 383 vertices, the graph 384");
  mesh.emplace_back(0, std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_EQ(fit.Fit(mesh).status().message(), "graph fit: the mesh has a vertex that is not finite");
}

}  // namespace
}  // namespace weft
