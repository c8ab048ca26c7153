// Consensus and refinement of one node by kernels. The plain path of the same steps is in consensus.h and
// refine.h: both try the same pairs of rays and end in the same point, up to rounding.
#pragma once

#include <optional>
#include <vector>

#include "triangulation/cloud.h"
#include "triangulation/ray_blocks.h"
#include "triangulation/refine.h"
#include "triangulation/triangulate.h"

namespace weft {

// What became of one seen node.
struct NodeResult {
  std::optional<RefinedPoint> point;
  int views = 0;  // inliers of a point, cameras that saw a rejected node
  RejectReason reason = RejectReason::kTooFewViews;
};

// Keeps references to its arguments; one solver per thread.
class NodeSolver {
 public:
  NodeSolver(const TriangulationOptions& options, const std::vector<RayCamera>& cameras);

  NodeResult Solve(const NodeRays& node, const RayBlock& block);

 private:
  NodeResult SolvePair(uint64_t seed);
  bool FindPoint(const ConsensusOptions& options, uint64_t seed);
  void TryPair(int i, int j, double min_sine2, double radius_mm);
  std::optional<Eigen::Vector3d> MiddleOf(int i, int j, double min_sine2, double radius_mm) const;
  RayScore ScoreAt(const Eigen::Vector3f& point_mm, double radius_mm) const;
  void MoveReference(const Eigen::Vector3d& reference_mm);
  std::optional<RefinedPoint> Refine(bool select_by_radius);
  bool Linearise(bool select_by_radius, RaySystem* system);
  bool KeepBestOfCamera(float (LocalTile::*flag)[kRayLanes]);
  int Count(float (LocalTile::*flag)[kRayLanes]) const;
  bool AnglesSuffice() const;

  template <typename T>
  T Of(T (LocalTile::*field)[kRayLanes], int ray) const {
    return (local_[ray / kRayLanes].*field)[ray % kRayLanes];
  }
  int CameraOf(int ray) const { return records_[ray].camera; }
  Eigen::Map<const Eigen::Vector3d> AlongOf(int ray) const {
    return Eigen::Map<const Eigen::Vector3d>(records_[ray].along);
  }
  Eigen::Map<const Eigen::Vector3d> OriginOf(int ray) const {
    return Eigen::Map<const Eigen::Vector3d>(cameras_[CameraOf(ray)].origin_mm);
  }

  const TriangulationOptions& options_;
  const std::vector<RayCamera>& cameras_;
  RayLimits limits_;
  // Of the node at hand.
  const RayRecord* records_ = nullptr;
  int rays_ = 0;
  int distinct_ = 0;  // cameras
  std::vector<LocalTile> local_;
  bool has_reference_ = false;
  Eigen::Vector3d reference_mm_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d point_mm_ = Eigen::Vector3d::Zero();  // from the reference
  RayScore best_;
};

}  // namespace weft
