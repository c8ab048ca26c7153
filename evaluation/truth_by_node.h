// The truth of a mesh whose template is not the truth's own: both know what of the board their vertices are.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "simulation/printed_mesh.h"
#include "simulation/view_truth.h"

namespace weft {

// Whether both have as many vertices and the same faces: of cloth without a board all that tells whether
// vertex v of one is vertex v of the other.
bool HaveSameFaces(const GarmentMesh& a, const GarmentMesh& b);

// Whether vertex v of one is vertex v of the other: the same faces and the same nodes of the board.
bool HaveSameVertices(const Template& a, const Template& b);

// Immutable; any number of threads may ask at once.
class TruthByNode {
 public:
  // `of_truth`: the template whose vertices the truth's meshes have. FailedPrecondition: they were sewn from
  // different boards (both hashes named), or share no place of the board.
  static absl::StatusOr<TruthByNode> Build(const Template& of_result, const Template& of_truth);

  // Vertices of the result whose place on the true cloth is known.
  int matched() const { return matched_; }
  size_t vertices() const { return nodes_.size(); }

  // True positions, [vertices of the result] in mm: at the truth's vertex of the same cell, else where the
  // print of the true mesh carries the node. NaN where it does not.
  std::vector<Eigen::Vector3d> Positions(const std::vector<Eigen::Vector3d>& true_mm) const;
  // In how many views the node of each vertex is scoreable, [vertices of the result].
  std::vector<int> ScoreableViews(const FrameTruth& truth) const;

 private:
  std::vector<VertexNode> nodes_;                   // [vertices of the result]
  std::vector<int> vertex_;                         // of the truth; -1 where it has none for the node
  std::vector<std::optional<SurfacePoint>> place_;  // on the true mesh, where there is no vertex
  std::vector<Face> faces_;                         // of the truth
  int matched_ = 0;
};

}  // namespace weft
