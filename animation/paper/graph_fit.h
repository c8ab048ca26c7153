// The graph's motions that come nearest to a known mesh (Halimi et al. 2022, Eq. 6).
#pragma once

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/paper/deformation_graph.h"

namespace weft {

struct GraphFitOptions {
  // Of E_Dist against the squared distances of the vertices: large enough that nodes follow their neighbours
  // where nothing else holds them.
  double distortion = 0.02;
  int max_steps = 8;
  double tolerance_mm = 0.05;  // a step that moves no node further ends it

  absl::Status Validate() const;
};

// Not for use by two threads at once.
class GraphFit {
 public:
  // The graph must outlive it; options are valid.
  GraphFit(const DeformationGraph& graph, const GraphFitOptions& options);

  // Minimises sum |x - mesh|^2 + distortion * sum over adjacent nodes |T_i g_j - T_j g_j|^2 by Gauss-Newton
  // from `start`, [nodes]; empty: all nodes as the mesh lies at best as a whole. InvalidArgument: a mesh of
  // other vertices or not finite. Internal: the system has no solution.
  absl::StatusOr<std::vector<Eigen::Isometry3d>> Fit(const std::vector<Eigen::Vector3d>& mesh_mm,
                                                     std::vector<Eigen::Isometry3d> start = {});

 private:
  using Block = Eigen::Matrix<double, 6, 6>;
  int SlotOf(int a, int b) const;
  void AddVertices(const std::vector<Eigen::Vector3d>& mesh_mm, const std::vector<Eigen::Isometry3d>& motions,
                   Eigen::VectorXd* right);
  void AddDistortion(const std::vector<Eigen::Isometry3d>& motions, Eigen::VectorXd* right);
  bool Solve(const Eigen::VectorXd& right, Eigen::VectorXd* step);

  const DeformationGraph& graph_;
  GraphFitOptions options_;
  std::vector<std::vector<std::pair<int, int>>> slots_;  // [nodes], of larger nodes; their blocks
  std::vector<Block> blocks_;                            // of the nodes, then of adjacent ones
  bool is_analyzed_ = false;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

}  // namespace weft
