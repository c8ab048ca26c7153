// What other ways make of a frame that an avatar drives.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "alignment/mesh_graph.h"
#include "alignment/template.h"
#include "animation/shape/shape_space.h"
#include "capture/rig/rig.h"
#include "figure/body.h"
#include "figure/pose.h"
#include "figure/skeleton.h"
#include "triangulation/triangulate.h"

namespace weft {

// What `weft register` makes of the same observations: points where their rays meet, cleaned, and the
// template aligned to them. It does not look at pictures again.
class RegistrationBaseline {
 public:
  explicit RegistrationBaseline(const Template& garment);

  // FailedPrecondition: two cameras see too little together. Runs in the calling thread's TBB arena.
  absl::StatusOr<RegisteredMesh> Register(const Rig& rig, const std::vector<ViewObservations>& views) const;

 private:
  const Template& garment_;
  AlignmentModel model_;
};

// The mean shape of a space, and its shape that is nearest to the truth, both at the truth's place.
struct PlacedShapes {
  std::vector<Eigen::Vector3d> mean_mm, best_mm;
};
PlacedShapes PlaceShapes(const ShapeSpace& space, const std::vector<Eigen::Vector3d>& truth_mm);

// Cloth that the wearer moves by linear blend skinning: each vertex follows the part of the body that is
// nearest to it in a frame whose cloth and pose are known, blended with what its neighbours along the cloth
// follow.
class SkinnedBaseline {
 public:
  // `bound_mm`: [vertices] in the pose `bound`. The graph must outlive it.
  SkinnedBaseline(const MeshGraph& graph, const BodyShape& body, std::vector<Eigen::Vector3d> bound_mm,
                  const FigurePose& bound)
      : graph_(graph), shape_(body), bound_mm_(std::move(bound_mm)), bound_(bound, body) {}

  std::vector<Eigen::Vector3d> MeshIn(const FigurePose& pose) const;

 private:
  const MeshGraph& graph_;
  BodyShape shape_;
  std::vector<Eigen::Vector3d> bound_mm_;
  Body bound_;
};

}  // namespace weft
