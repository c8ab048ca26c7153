#include "animation/paper/deformation_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "animation/shape/edge_vectors.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Of a vertex that is as far from its last node as from the first that does not carry it.
constexpr double kLeastSkinWeight = 1e-4;
// Below this angle series stand in for quotients.
constexpr double kSmallAngle = 1e-6;

Eigen::Matrix3d Crossing(const Eigen::Vector3d& a) {
  Eigen::Matrix3d out;
  out << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return out;
}

Eigen::Matrix3d RotationOf(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle < kSmallAngle)
    return Eigen::Quaterniond(1, vector.x() / 2, vector.y() / 2, vector.z() / 2)
        .normalized()
        .toRotationMatrix();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

// Of a rotation vector's change, the angular velocity (left Jacobian of SO(3)).
Eigen::Matrix3d LeftJacobian(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  const Eigen::Matrix3d cross = Crossing(vector);
  if (angle < 1e-3) return Eigen::Matrix3d::Identity() + 0.5 * cross + cross * cross / 6;
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / (angle * angle) * cross +
         (angle - std::sin(angle)) / (angle * angle * angle) * cross * cross;
}

// The nearest nodes of a vertex, and one more, which says where their weight ends.
void SkinVertex(const std::vector<std::vector<double>>& ways, size_t v, int count, int* nodes,
                double* weights) {
  std::vector<int> order(ways.size());
  std::iota(order.begin(), order.end(), 0);
  const auto wanted = std::min(order.size(), static_cast<size_t>(count) + 1);
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(wanted), order.end(),
                    [&](int a, int b) { return ways[a][v] != ways[b][v] ? ways[a][v] < ways[b][v] : a < b; });
  double end = 0;
  for (size_t k = 0; k < wanted; ++k)
    if (std::isfinite(ways[order[k]][v])) end = std::max(end, ways[order[k]][v]);
  double sum = 0;
  for (int k = 0; k < count; ++k) {
    nodes[k] = order[std::min<size_t>(static_cast<size_t>(k), order.size() - 1)];
    const double way = ways[nodes[k]][v];
    const bool carries = static_cast<size_t>(k) < order.size() && std::isfinite(way);
    weights[k] = carries ? std::max(kLeastSkinWeight, std::pow(1 - way / std::max(end, 1e-9), 2)) : 0;
    sum += weights[k];
  }
  for (int k = 0; k < count; ++k) weights[k] /= sum;
}

}  // namespace

absl::Status GraphOptions::Validate() const {
  if (nodes < 2 || nodes > 1000) return absl::InvalidArgumentError("graph: nodes must be 2 to 1000");
  if (nodes_of_vertex < 1 || nodes_of_vertex > 16)
    return absl::InvalidArgumentError("graph: nodes_of_vertex must be 1 to 16");
  return absl::OkStatus();
}

absl::StatusOr<DeformationGraph> BuildDeformationGraph(const TriangleMesh& rest, const MeshGraph& graph,
                                                       const GraphOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  if (graph.vertices < 2) return absl::InvalidArgumentError("graph: the mesh has fewer than two vertices");
  const std::vector<Eigen::Vector3d>& points = rest.vertices_mm;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) middle += p / graph.vertices;
  const FarPoints far = ChooseFarPoints(options.nodes, rest, graph);
  const std::vector<int>& chosen = far.vertices;
  const std::vector<std::vector<double>>& ways = far.ways_mm;
  const auto count = static_cast<int>(chosen.size());
  const auto root = static_cast<int>(std::min_element(chosen.begin(), chosen.end(),
                                                      [&](int a, int b) {
                                                        return (points[a] - middle).squaredNorm() <
                                                               (points[b] - middle).squaredNorm();
                                                      }) -
                                     chosen.begin());
  // Nodes in the order of their way from the root, so that a parent is known first. Ways from node to node
  // count by their square, so that many short ones are better than a long one.
  const std::vector<double>& to_root = ways[root];
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const double way_a = to_root[chosen[a]], way_b = to_root[chosen[b]];
    return way_a != way_b ? way_a < way_b : a < b;
  });
  std::vector<int> place(count);
  for (int k = 0; k < count; ++k) place[order[k]] = k;
  std::vector<double> cost(count, 0);
  DeformationGraph out;
  out.rest_mm = points;
  out.nodes_of_vertex = options.nodes_of_vertex;
  for (int k = 0; k < count; ++k) {
    const int i = order[k];
    int parent = k == 0 ? -1 : 0;
    double best = std::numeric_limits<double>::infinity();
    for (int j = 0; j < k; ++j) {
      const double way = ways[order[j]][chosen[i]], total = cost[j] + way * way;
      if (std::isfinite(way) && total < best) best = total, parent = j;
    }
    if (std::isfinite(best)) cost[k] = best;
    out.node.push_back(chosen[i]);
    out.parent.push_back(parent);
  }
  const size_t slots = points.size() * static_cast<size_t>(out.nodes_of_vertex);
  out.skin_node.resize(slots), out.skin_weight.resize(slots);
  std::set<std::pair<int, int>> adjacent;
  for (size_t v = 0; v < points.size(); ++v) {
    int* nodes = &out.skin_node[v * static_cast<size_t>(out.nodes_of_vertex)];
    double* weights = &out.skin_weight[v * static_cast<size_t>(out.nodes_of_vertex)];
    SkinVertex(ways, v, out.nodes_of_vertex, nodes, weights);
    for (int k = 0; k < out.nodes_of_vertex; ++k) nodes[k] = place[nodes[k]];
    for (int a = 0; a < out.nodes_of_vertex; ++a)
      for (int b = 0; b < a; ++b)
        if (weights[a] > 0 && weights[b] > 0)
          adjacent.insert({std::min(nodes[a], nodes[b]), std::max(nodes[a], nodes[b])});
  }
  out.adjacent.assign(adjacent.begin(), adjacent.end());
  return out;
}

std::vector<Eigen::Isometry3d> PlaceNodes(const DeformationGraph& graph, const Eigen::Isometry3d& root,
                                          const GraphPose& pose) {
  std::vector<Eigen::Isometry3d> out;
  out.reserve(static_cast<size_t>(graph.nodes()));
  for (int i = 0; i < graph.nodes(); ++i) {
    Eigen::Isometry3d own = Eigen::Isometry3d::Identity();
    own.linear() = RotationOf(pose.col(i).head<3>());
    own.translation() = graph.NodeMm(i) + pose.col(i).tail<3>() - own.linear() * graph.NodeMm(i);
    out.push_back(graph.parent[i] < 0 ? root : out[static_cast<size_t>(graph.parent[i])] * own);
  }
  return out;
}

GraphPose PoseOfNodes(const DeformationGraph& graph, const std::vector<Eigen::Isometry3d>& motions) {
  GraphPose out = GraphPose::Zero(6, graph.nodes());
  for (int i = 1; i < graph.nodes(); ++i) {
    const Eigen::Isometry3d own = motions[static_cast<size_t>(graph.parent[i])].inverse() * motions[i];
    const Eigen::AngleAxisd turn(own.linear());
    out.col(i).head<3>() = turn.angle() * turn.axis();
    out.col(i).tail<3>() = own * graph.NodeMm(i) - graph.NodeMm(i);
  }
  return out;
}

std::vector<Eigen::Vector3d> SkinnedMesh(const DeformationGraph& graph,
                                         const std::vector<Eigen::Isometry3d>& motions) {
  std::vector<Eigen::Vector3d> out;
  out.reserve(graph.rest_mm.size());
  for (int v = 0; v < graph.vertices(); ++v) out.push_back(SkinnedPoint(graph, v, motions));
  return out;
}

Eigen::Vector3d SkinnedPoint(const DeformationGraph& graph, int vertex,
                             const std::vector<Eigen::Isometry3d>& motions) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  const auto per_vertex = static_cast<size_t>(graph.nodes_of_vertex), v = static_cast<size_t>(vertex);
  for (size_t s = v * per_vertex; s < (v + 1) * per_vertex; ++s)
    out += graph.skin_weight[s] * (motions[static_cast<size_t>(graph.skin_node[s])] * graph.rest_mm[v]);
  return out;
}

NodeVelocities VelocitiesOf(const DeformationGraph& graph, const GraphPose& pose,
                            const std::vector<Eigen::Isometry3d>& motions, const Eigen::MatrixXd& pose_ways) {
  NodeVelocities out;
  out.emplace_back(6, pose_ways.cols());
  out[0].setZero();
  for (int i = 1; i < graph.nodes(); ++i) {
    const auto parent = static_cast<size_t>(graph.parent[i]);
    const Eigen::Matrix3d axes = motions[parent].linear();
    const Eigen::Matrix3Xd angular =
        axes * LeftJacobian(pose.col(i).head<3>()) * pose_ways.middleRows(6 * i, 3);
    const Eigen::Vector3d here = motions[i] * graph.NodeMm(i);
    out.push_back(out[parent]);
    out.back().topRows<3>() += angular;
    out.back().bottomRows<3>() += Crossing(here) * angular + axes * pose_ways.middleRows(6 * i + 3, 3);
  }
  return out;
}

Eigen::Matrix3Xd VelocityOf(const DeformationGraph& graph, int vertex,
                            const std::vector<Eigen::Isometry3d>& motions, const NodeVelocities& velocities) {
  Eigen::Matrix3Xd out = Eigen::Matrix3Xd::Zero(3, velocities[0].cols());
  const auto per_vertex = static_cast<size_t>(graph.nodes_of_vertex), v = static_cast<size_t>(vertex);
  for (size_t s = v * per_vertex; s < (v + 1) * per_vertex; ++s) {
    const double weight = graph.skin_weight[s];
    if (weight == 0) continue;
    const auto node = static_cast<size_t>(graph.skin_node[s]);
    const Eigen::Vector3d at = motions[node] * graph.rest_mm[v];
    out +=
        weight * velocities[node].bottomRows<3>() - (weight * Crossing(at)) * velocities[node].topRows<3>();
  }
  return out;
}

}  // namespace weft
