// The triangulated cells of one frame set.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>
#include <vector>

#include "pattern/observation.h"

namespace weft {

struct CloudPoint {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  BoardNode node;
  int views = 0;        // inlier rays from distinct cameras
  double sigma_mm = 0;  // square root of a third of the covariance's trace
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
  // The part of it that folds cause (SharpenCenters). Cells around a fold share it, so a mean over neighbours
  // knows no better.
  Eigen::Matrix3d fold_covariance_mm2 = Eigen::Matrix3d::Zero();
};

// Why a node that was seen has no point in the cloud.
enum class RejectReason : uint8_t {
  kTooFewViews,     // seen by fewer cameras than required
  kNoConsensus,     // no hypothesis gathers enough rays within the radius
  kPoorGeometry,    // rays nearly parallel, sigma above the limit
  kIsolated,        // cleaning: few neighbours around it
  kStretchedEdges,  // cleaning: far from its neighbours on the board
  kSmallComponent,  // cleaning: small piece far from trusted ones
  kUnconfirmed,     // cleaning: seen by two cameras, without neighbours that confirm it
};
inline constexpr int kRejectReasons = 7;
std::string_view RejectReasonName(RejectReason reason);  // "too_few_views" ...

struct RejectedNode {
  BoardNode node;
  int views = 0;
  RejectReason reason = RejectReason::kTooFewViews;
};

// One camera's sight of a node without a point: the line on which the node lies.
struct CloudRay {
  BoardNode node;
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();   // the camera's centre
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // length 1
  double sigma_rad = 0;                                  // standard deviation per axis across it
};

// Points, rejected nodes and rays ordered by kind, row, column.
struct Cloud {
  std::vector<CloudPoint> points;
  std::vector<RejectedNode> rejected;
  std::vector<CloudRay> rays;  // of rejected nodes (RaysOfRejected)
};

// The node's point; null where the cloud has none.
const CloudPoint* FindPoint(const Cloud& cloud, const BoardNode& node);

}  // namespace weft
