// Where the template lies as a whole, before it bends.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/align.h"

namespace weft {

// InvalidArgument names the first target that is not on the mesh, occurs twice or is not finite.
absl::Status CheckTargets(const std::vector<VertexTarget>& targets, int vertices);

// InvalidArgument where a start has another number of vertices, or one that is not finite.
absl::Status CheckStart(const std::vector<Eigen::Vector3d>& start_mm, int vertices);

// The rigid motion that brings `from` onto `to`, by least squares (Umeyama 1991, without scale). Sizes are
// equal and not zero.
Eigen::Isometry3d RigidFit(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to);

// Median length of the edges between neighbouring targets, against the template's; 0 where there is none.
double ClothScale(const AlignmentModel& model, const std::vector<VertexTarget>& targets);

// How many targets place a mesh of so many vertices; `min_target_share` as in AlignOptions.
double LeastTargets(int vertices, double min_target_share);

// Least-squares rigid transformation from rest positions to targets (Umeyama 1991, without scale).
// FailedPrecondition where the targets are too few, lie on a line or are of another scale than the template.
absl::StatusOr<Eigen::Isometry3d> PlaceTemplate(const AlignmentModel& model,
                                                const std::vector<VertexTarget>& targets,
                                                double min_target_share);

// Start of the fill: the target of every vertex that has one, otherwise its position in `base_mm`.
// Components with one or two targets move with their mean. `known` marks what is not filled: targets, and
// every vertex of components with fewer than three.
struct FillStart {
  std::vector<Eigen::Vector3d> position_mm;
  std::vector<bool> known;
};
FillStart PrepareFill(const MeshGraph& graph, const std::vector<VertexTarget>& targets,
                      std::vector<Eigen::Vector3d> base_mm);

// `start_mm` moved with the targets. Each vertex with a target moves to it; others, in components with at
// least three targets, by a smooth fill of these displacements.
absl::StatusOr<std::vector<Eigen::Vector3d>> MovedWithTargets(const MeshGraph& graph,
                                                              const std::vector<VertexTarget>& targets,
                                                              const std::vector<Eigen::Vector3d>& start_mm);

}  // namespace weft
