// The mesh whose edges are as long as the cloth's, by Gauss-Newton with a sparse factorisation: lengths are
// what tells depth where one ray passes each vertex.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh_graph.h"
#include "animation/rays/evidence.h"

namespace weft {

// Chosen on the split validate of the data set shirt-drive-12 before two cameras (refit: `accuracy_drive
// DIR/takes --tests validate --cameras 2` with --strain, --tail, --bend, --steps and --tolerance). Mean
// errors there were 1 to 3 % larger with a strain of 0.012 or 0.022, a freedom of 1 or 4, a share of 0.3 or
// 0.6, and a tolerance of 0.1.
struct IsometricOptions {
  // Lengths of edges vary by their spread over the training frames, or by this share of them where that is
  // less, with the tails of Student's t: a wrinkle's crest strains a few edges far more than most.
  double least_strain = 0.016;
  double tail_freedom = 2;
  // Standard deviation of how an edge differs from that of the carrier, per axis, over the mean edge.
  double bend_share = 0.4;
  int max_steps = 12;
  int steps_of_factor = 4;    // before the matrix is factorised anew: it costs as much as ten steps
  double tolerance_mm = 0.3;  // ends when a step moves vertices less, root mean square

  absl::Status Validate() const;
};

// How long edges of the garment are, [edges]: in the mean, by how much of its difference from that the length
// follows the carrier's, and the standard deviation of what is left. Crests and strain that the carrier knows
// are told from its own errors by that share.
struct EdgeLengths {
  std::span<const float> mean_mm, follow, spread_mm;
};

// Isometric shape from template (Bartoli et al., PAMI 2015, of smooth surfaces and one view): lengths and
// lines of sight determine depth together, but for mirrored bumps, which the start decides. Keeps the
// symbolic factorisation of the graph's matrix. Not for use by two threads at once. The same bytes at any
// thread count.
class IsometricFit {
 public:
  // Graph and lengths must outlive it.
  IsometricFit(const MeshGraph& graph, const EdgeLengths& lengths, const IsometricOptions& options);

  // Minimises the sum of `evidence`, [vertices], + rho((length - expected) / spread) over edges + |edge -
  // carrier's edge|^2 / bend_sigma^2, from `position_mm`, [vertices], which receives the result. The evidence
  // must hold each connected part. `is_alike`: it differs from that of the last call at few vertices, so the
  // factor of that call serves first. Internal: the matrix could not be factorised.
  absl::Status Solve(std::span<const RayEvidence> evidence, std::span<const Eigen::Vector3d> carrier_mm,
                     std::vector<Eigen::Vector3d>* position_mm, bool is_alike = false);

 private:
  double Energy(std::span<const RayEvidence> evidence, std::span<const Eigen::Vector3d> carrier_mm,
                std::span<const Eigen::Vector3d> x) const;
  // The gradient, and the matrix as well where `with_matrix`.
  void Build(std::span<const RayEvidence> evidence, std::span<const Eigen::Vector3d> carrier_mm,
             std::span<const Eigen::Vector3d> x, bool with_matrix);

  const MeshGraph& graph_;
  EdgeLengths lengths_;
  IsometricOptions options_;
  std::vector<double> expected_mm_, spread_mm_;  // [edges]
  double bend_information_ = 0;                  // 1/mm^2
  std::vector<int> first_of_edge_;               // [edges][3], where the columns of an edge's block begin
  Eigen::SparseMatrix<double> matrix_;           // lower triangle, [3 vertices][3 vertices]
  Eigen::VectorXd gradient_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor_;
  bool has_factor_ = false;
};

}  // namespace weft
