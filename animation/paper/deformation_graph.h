// A mesh that few nodes move (Halimi et al. 2022, section 6.2.1): each carries the cloth around it and hangs
// on another one, so that the whole is a tree of rigid motions.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/mesh_graph.h"

namespace weft {

struct GraphOptions {
  int nodes = 128;          // fewer on meshes of fewer vertices
  int nodes_of_vertex = 5;  // that carry a vertex

  absl::Status Validate() const;
};

struct DeformationGraph {
  std::vector<Eigen::Vector3d> rest_mm;  // [vertices]
  std::vector<int> node;                 // [nodes], their vertices; the root first, each after its parent
  std::vector<int> parent;               // [nodes], -1 for the root
  int nodes_of_vertex = 0;
  std::vector<int> skin_node;                 // [vertices][nodes_of_vertex]
  std::vector<double> skin_weight;            // as many; of a vertex they sum to 1
  std::vector<std::pair<int, int>> adjacent;  // nodes that carry a vertex together, first < second, ordered

  int nodes() const { return static_cast<int>(node.size()); }
  int vertices() const { return static_cast<int>(rest_mm.size()); }
  const Eigen::Vector3d& NodeMm(int i) const { return rest_mm[static_cast<size_t>(node[i])]; }
};

// Nodes as far from each other along the cloth as can be; the root is the one nearest to the middle of the
// mesh, and the tree is that of the shortest ways to it. Vertices are carried by their nearest nodes, with
// (1 - way / way to the first that does not)^2 (Sumner et al. 2007). Where a part of the mesh does not hang
// together with the root, its first node hangs on the root. InvalidArgument for options, or a mesh without
// vertices.
absl::StatusOr<DeformationGraph> BuildDeformationGraph(const TriangleMesh& rest, const MeshGraph& graph,
                                                       const GraphOptions& options);

// Of each node the rotation vector and the shift in mm, against its parent, in the parent's axes; a node
// turns about itself. The root's are 0: where the whole stands is told apart.
using GraphPose = Eigen::Matrix<double, 6, Eigen::Dynamic>;

// The motion of each node from the mesh at rest; `root` is that of the root.
std::vector<Eigen::Isometry3d> PlaceNodes(const DeformationGraph& graph, const Eigen::Isometry3d& root,
                                          const GraphPose& pose);
// The pose that PlaceNodes makes these of, with the root's motion as `root`.
GraphPose PoseOfNodes(const DeformationGraph& graph, const std::vector<Eigen::Isometry3d>& motions);

// By linear blend skinning, [vertices].
std::vector<Eigen::Vector3d> SkinnedMesh(const DeformationGraph& graph,
                                         const std::vector<Eigen::Isometry3d>& motions);
// One vertex of it.
Eigen::Vector3d SkinnedPoint(const DeformationGraph& graph, int vertex,
                             const std::vector<Eigen::Isometry3d>& motions);

// How nodes move where the pose does: per node and number the angular velocity, and the velocity of what is
// at the origin, [nodes] of [6][numbers]. `pose_ways`: [6 * nodes][numbers], the change of the pose, column
// by column of GraphPose; `motions`: PlaceNodes with the root at rest.
using NodeVelocities = std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>>;
NodeVelocities VelocitiesOf(const DeformationGraph& graph, const GraphPose& pose,
                            const std::vector<Eigen::Isometry3d>& motions, const Eigen::MatrixXd& pose_ways);
// The same of a vertex, [3][numbers].
Eigen::Matrix3Xd VelocityOf(const DeformationGraph& graph, int vertex,
                            const std::vector<Eigen::Isometry3d>& motions, const NodeVelocities& velocities);

}  // namespace weft
