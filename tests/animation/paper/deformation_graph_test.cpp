#include "animation/paper/deformation_graph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "alignment/mesh_graph.h"
#include "animation/paper/graph_prior.h"
#include "base/counter_random.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

// A strip of cloth in the plane, long in x.
TriangleMesh Strip(int columns = 41, int rows = 5, double cell_mm = 10) {
  TriangleMesh out;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) out.vertices_mm.emplace_back(cell_mm * c, cell_mm * r, 0);
  for (int r = 0; r + 1 < rows; ++r)
    for (int c = 0; c + 1 < columns; ++c) {
      const int a = r * columns + c;
      out.faces.push_back({a, a + 1, a + columns});
      out.faces.push_back({a + 1, a + columns + 1, a + columns});
    }
  return out;
}

DeformationGraph GraphOf(const TriangleMesh& mesh, int nodes) {
  GraphOptions options;
  options.nodes = nodes;
  return *BuildDeformationGraph(mesh, BuildMeshGraph(mesh), options);
}

GraphPose RandomPose(const DeformationGraph& graph, double turn, double shift_mm) {
  GraphPose out = GraphPose::Zero(6, graph.nodes());
  for (int i = 1; i < graph.nodes(); ++i)
    for (int k = 0; k < 6; ++k)
      out(k, i) = (k < 3 ? turn : shift_mm) * NormalOf(3, static_cast<uint64_t>(6 * i + k));
  return out;
}

Eigen::Isometry3d SomeMotion() {
  return Eigen::Translation3d(30, -70, 900) *
         Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized());
}

TEST(DeformationGraph, IsATreeOverTheMesh) {
  const TriangleMesh mesh = Strip();
  const DeformationGraph graph = GraphOf(mesh, 12);
  ASSERT_EQ(graph.nodes(), 12);
  EXPECT_EQ(graph.parent[0], -1);
  // The root is in the middle: of 400 mm a node lies at most half a spacing away.
  EXPECT_NEAR(graph.NodeMm(0).x(), 200, 40);
  for (int i = 1; i < graph.nodes(); ++i) {
    ASSERT_GE(graph.parent[i], 0);
    ASSERT_LT(graph.parent[i], i);
    // Along a strip the tree's branches lead outwards, from neighbour to neighbour.
    EXPECT_LT((graph.NodeMm(i) - graph.NodeMm(graph.parent[i])).norm(), 130);
  }
  for (int v = 0; v < graph.vertices(); ++v) {
    double sum = 0;
    for (int k = 0; k < graph.nodes_of_vertex; ++k) {
      const double weight = graph.skin_weight[static_cast<size_t>(v * graph.nodes_of_vertex + k)];
      EXPECT_GE(weight, 0);
      sum += weight;
    }
    EXPECT_NEAR(sum, 1, 1e-12);
  }
}

TEST(DeformationGraph, AtRestIsTheMeshAndMovesRigidly) {
  const TriangleMesh mesh = Strip();
  const DeformationGraph graph = GraphOf(mesh, 12);
  const auto moved = SkinnedMesh(graph, PlaceNodes(graph, SomeMotion(), GraphPose::Zero(6, graph.nodes())));
  for (size_t v = 0; v < moved.size(); ++v)
    EXPECT_LT((moved[v] - SomeMotion() * mesh.vertices_mm[v]).norm(), 1e-9);
}

TEST(DeformationGraph, PosesComeBack) {
  const DeformationGraph graph = GraphOf(WavingTube::Garment().rest, 20);
  const GraphPose pose = RandomPose(graph, 0.3, 10);
  EXPECT_LT((PoseOfNodes(graph, PlaceNodes(graph, SomeMotion(), pose)) - pose).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(DeformationGraph, VelocitiesAreThoseOfDifferences) {
  const DeformationGraph graph = GraphOf(WavingTube::Garment().rest, 12);
  const GraphPose pose = RandomPose(graph, 0.4, 15);
  const Eigen::Index numbers = 6 * graph.nodes();
  Eigen::MatrixXd ways(numbers, 3);
  for (Eigen::Index i = 0; i < ways.size(); ++i)
    ways.data()[i] = i % numbers < 6 ? 0 : 0.1 * NormalOf(5, static_cast<uint64_t>(i));
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  const auto motions = PlaceNodes(graph, still, pose);
  const NodeVelocities velocities = VelocitiesOf(graph, pose, motions, ways);
  constexpr double kStep = 1e-5;
  for (int k = 0; k < 3; ++k) {
    const auto at = [&](double by) {
      const Eigen::VectorXd change = by * ways.col(k);
      return SkinnedMesh(
          graph,
          PlaceNodes(graph, still, pose + Eigen::Map<const GraphPose>(change.data(), 6, graph.nodes())));
    };
    const auto ahead = at(kStep), behind = at(-kStep);
    for (int v = 0; v < graph.vertices(); v += 7) {
      const Eigen::Vector3d expected = (ahead[v] - behind[v]) / (2 * kStep);
      EXPECT_LT((VelocityOf(graph, v, motions, velocities).col(k) - expected).norm(), 1e-4);
    }
  }
}

TEST(DeformationGraph, TakesPartsThatDoNotHangTogether) {
  TriangleMesh mesh = Strip(11, 3);
  const auto vertices = static_cast<int>(mesh.vertices_mm.size());
  const TriangleMesh other = mesh;
  for (const Eigen::Vector3d& p : other.vertices_mm)
    mesh.vertices_mm.push_back(p + Eigen::Vector3d(0, 0, 50));
  for (const Face& face : other.faces)
    mesh.faces.push_back({face[0] + vertices, face[1] + vertices, face[2] + vertices});
  const DeformationGraph graph = GraphOf(mesh, 8);
  for (int v = 0; v < graph.vertices(); ++v)
    for (int k = 0; k < graph.nodes_of_vertex; ++k) {
      const auto slot = static_cast<size_t>(v * graph.nodes_of_vertex + k);
      if (graph.skin_weight[slot] == 0) continue;
      EXPECT_EQ(graph.node[static_cast<size_t>(graph.skin_node[slot])] < vertices, v < vertices);
    }
  const auto moved = SkinnedMesh(graph, PlaceNodes(graph, SomeMotion(), GraphPose::Zero(6, graph.nodes())));
  for (size_t v = 0; v < moved.size(); ++v)
    EXPECT_LT((moved[v] - SomeMotion() * mesh.vertices_mm[v]).norm(), 1e-9);
}

TEST(DeformationGraph, RefusesBadOptions) {
  const TriangleMesh mesh = Strip();
  GraphOptions options;
  options.nodes = 1;
  EXPECT_FALSE(BuildDeformationGraph(mesh, BuildMeshGraph(mesh), options).ok());
  options = {};
  options.nodes_of_vertex = 0;
  EXPECT_FALSE(BuildDeformationGraph(mesh, BuildMeshGraph(mesh), options).ok());
}

TEST(DeformationGraph, OfTheTubeStaysAsItIs) {
  const DeformationGraph graph = GraphOf(WavingTube::Garment().rest, 12);
  const GraphPose pose = RandomPose(graph, 0.4, 15);
  const auto motions = PlaceNodes(graph, SomeMotion(), pose);
  Recorded recorded;
  recorded.Add("node", graph.node);
  recorded.Add("parent", graph.parent);
  recorded.Add("skin_node", graph.skin_node);
  recorded.Add("skin_weight", graph.skin_weight);
  recorded.Add("adjacent", graph.adjacent);
  recorded.Add("motions", motions);
  recorded.Add("mesh", SkinnedMesh(graph, motions));
  recorded.Add("units", PoseUnits(graph, 10));
  recorded.Expect();
}

TEST(DeformationGraph, HasNoMoreNodesThanTheMeshHasVertices) {
  const TriangleMesh mesh = Strip(2, 2);
  const DeformationGraph graph = GraphOf(mesh, 100);
  EXPECT_EQ(graph.nodes(), 4);
  EXPECT_EQ(graph.skin_node.size(), 20u);
  const auto moved = SkinnedMesh(graph, PlaceNodes(graph, SomeMotion(), GraphPose::Zero(6, 4)));
  for (size_t v = 0; v < 4; ++v) EXPECT_LT((moved[v] - SomeMotion() * mesh.vertices_mm[v]).norm(), 1e-9);
  TriangleMesh point;
  point.vertices_mm = {{0, 0, 0}};
  EXPECT_EQ(BuildDeformationGraph(point, BuildMeshGraph(point), {}).status().message(),
            "graph: the mesh has fewer than two vertices");
}

// Turns so small that a quotient would be rough, and others just beyond.
TEST(DeformationGraph, SmallTurnsAreExact) {
  const DeformationGraph graph = GraphOf(Strip(), 3);
  for (const double turn : {1e-9, 0.9e-6, 1.1e-6, 0.9e-3, 1.1e-3}) {
    const GraphPose pose = RandomPose(graph, turn, 0);
    const auto motions = PlaceNodes(graph, Eigen::Isometry3d::Identity(), pose);
    for (int i = 1; i < 3; ++i) {
      const Eigen::Vector3d by = pose.col(i).head<3>();
      const Eigen::Matrix3d own = motions[static_cast<size_t>(graph.parent[i])].linear().transpose() *
                                  motions[static_cast<size_t>(i)].linear();
      EXPECT_LT((own - Eigen::AngleAxisd(by.norm(), by.normalized()).toRotationMatrix()).norm(), 1e-14);
    }
    Eigen::MatrixXd ways = Eigen::MatrixXd::Zero(18, 1);
    for (int k = 0; k < 3; ++k) ways(6 + k, 0) = pose(k, 1);
    // A turn that goes on about its own axis has just that angular velocity.
    const auto velocities = VelocitiesOf(graph, pose, motions, ways);
    EXPECT_LT((velocities[1].topRows<3>() - pose.col(1).head<3>()).norm(), 1e-9 * turn);
    // About another axis it is (1 - cos) / angle^2 of the cross product off.
    ways.setZero();
    ways(6, 0) = 1;
    const Eigen::Vector3d v = pose.col(1).head<3>(), x = Eigen::Vector3d::UnitX();
    const Eigen::Vector3d expected = x + 0.5 * v.cross(x) + v.cross(v.cross(x)) / 6;
    EXPECT_LT((VelocitiesOf(graph, pose, motions, ways)[1].topRows<3>() - expected).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace weft
