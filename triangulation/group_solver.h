// Consensus and refinement of the nodes of a group, side by side. The plain path of the same steps is in
// consensus.h and refine.h: both try the same pairs of rays and end in the same point, up to what the
// last step here leaves (kLeastNewtonGain).
#pragma once

#include <optional>
#include <vector>

#include "base/random.h"
#include "triangulation/cloud.h"
#include "triangulation/ray_groups.h"
#include "triangulation/refine.h"
#include "triangulation/triangulate.h"

namespace weft {

// What became of one seen node.
struct NodeResult {
  BoardNode node;
  std::optional<RefinedPoint> point;
  int views = 0;  // inliers of a point, cameras that saw a rejected node
  RejectReason reason = RejectReason::kTooFewViews;
};

// Keeps references to its arguments; one solver per thread.
class GroupSolver {
 public:
  GroupSolver(const TriangulationOptions& options, const std::vector<RayCamera>& cameras);

  // Appends a result for each node that has rays, in the order of the columns.
  void Solve(const RayGroup& group, std::vector<NodeResult>* results);

 private:
  // A node on its way.
  struct Lane {
    enum class Stage { kSearch, kRefine, kDone } stage = Stage::kDone;
    bool is_pair = false;  // of two rays, under TwoViewOptions
    int min_views = 0;
    double min_sine2 = 0;  // of the angle between the rays of a hypothesis
    // The search: pairs tried so far, or the pair that comes next where all are.
    Random random{0};
    int drawn = 0, draws = 0;
    int i = 0, j = 0;
    int best_cameras = 0;
    float best_squared_mm2 = 0;
    Eigen::Vector3d best_mm = Eigen::Vector3d::Zero();
    // The refinement.
    int round = 0;
    RefinedPoint refined;
    NodeResult result;
  };

  void Start(int lane);
  void FindPoints();
  bool NextHypothesis(int lane);
  bool TriesAllPairs(int lane) const;
  float CamerasToEndAt(int lane) const;
  void Assess(int lane);
  std::optional<Eigen::Vector3d> MiddleOf(int lane, int i, int j) const;
  void RefinePoints();
  void StartRefining();
  bool Step(int lane);
  void EndRound(int lane);
  bool AnglesSuffice(int lane) const;

  void TakeInliers(int lane);
  void Linearise();
  void Accumulate();
  const RayPoints& PointsOf(Lane::Stage stage);
  void KeepBestOfCameras();
  void SetPoint(int lane, const Eigen::Vector3d& point_mm);
  Eigen::Vector3d PointOf(int lane) const;
  Eigen::Vector3d StepOf(int lane) const;
  const RayRow& RowOf(int lane, int ray) const { return group_->rows[group_->RowOfRay(lane, ray)]; }

  const TriangulationOptions& options_;
  const std::vector<RayCamera>& cameras_;
  RayLimits limits_;
  double min_sine2_ = 0, min_sine2_of_two_views_ = 0;  // of the angle between the rays of a hypothesis
  double max_cosine_ = 1;                              // of the angle between the outermost inliers
  // Of the group at hand.
  const RayGroup* group_ = nullptr;
  Lane lanes_[kNodeLanes];
  std::vector<LinearRow> linear_;
  RayPoints points_;  // where the rows are linearised
  RaySteps steps_;
  GroupScore score_;
  GroupSystem system_;
  GroupSolution solution_;
  float enough_[kNodeLanes];  // cameras, of a hypothesis that ends the search
};

}  // namespace weft
