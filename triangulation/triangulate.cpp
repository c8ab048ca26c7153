#include "triangulation/triangulate.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/str_cat.h"
#include "triangulation/consensus.h"
#include "triangulation/node_index.h"
#include "triangulation/refine.h"
#include "triangulation/sight.h"

namespace weft {
namespace {

constexpr int kMaxNodeIndex = 4096;  // of a row or column, Board::Validate
constexpr size_t kNodesPerTask = 256;
constexpr int kMaxRefinementRounds = 4;

std::string NodeName(const BoardNode& node) {
  return absl::StrCat(node.kind == NodeKind::kCenter ? "center" : "corner", " (", node.row, ", ", node.col,
                      ")");
}

absl::Status CheckObservation(const CameraModel& camera, const Observation& o) {
  const auto bad = [&](const std::string& why) {
    return absl::InvalidArgumentError(
        absl::StrCat("observation of ", NodeName(o.node), " by camera ", camera.id, ": ", why));
  };
  if (o.node.kind != NodeKind::kCenter && o.node.kind != NodeKind::kCorner) return bad("kind is unknown");
  if (o.node.row < 0 || o.node.row > kMaxNodeIndex || o.node.col < 0 || o.node.col > kMaxNodeIndex) {
    return bad(absl::StrCat("row and column must lie in 0 to ", kMaxNodeIndex));
  }
  if (!std::isfinite(o.x_px) || !std::isfinite(o.y_px)) return bad("x_px or y_px is not finite");
  if (!(o.sigma_px > 0) || !std::isfinite(o.sigma_px)) return bad("sigma_px must be a positive number");
  return absl::OkStatus();
}

absl::Status CheckViews(const Rig& rig, const std::vector<ViewObservations>& views) {
  for (const ViewObservations& view : views) {
    if (view.camera < 0 || view.camera >= static_cast<int>(rig.cameras.size())) {
      return absl::InvalidArgumentError(absl::StrCat("view of camera ", view.camera, ": the rig has ",
                                                     rig.cameras.size(), " cameras, numbered from 0"));
    }
    for (const Observation& o : view.observations) {
      if (absl::Status status = CheckObservation(rig.cameras[view.camera], o); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

// What became of one seen node.
struct NodeResult {
  std::optional<RefinedPoint> point;
  int views = 0;  // inliers of a point, cameras that saw a rejected node
  RejectReason reason = RejectReason::kTooFewViews;
};

// The point of a node that two cameras saw, under stricter conditions than three need.
NodeResult TriangulatePair(std::span<const Sight> sights, const TriangulationOptions& options,
                           uint64_t seed) {
  NodeResult result{.views = 2};
  ConsensusOptions pair = options.consensus;
  pair.min_views = 2;
  pair.min_pair_angle_deg = std::max(pair.min_pair_angle_deg, options.two_view.min_angle_deg);
  const Consensus consensus = FindConsensus(sights, pair, seed);
  if (consensus.inliers.empty()) return result;
  const std::optional<RefinedPoint> point =
      RefinePoint(consensus.position_mm, sights, consensus.inliers, options.refinement);
  const double limit = options.two_view.max_residual_sigmas;
  if (!point || point->chi_square > limit * limit) return result;
  if (point->covariance_mm2.trace() > 3 * options.two_view.max_sigma_mm * options.two_view.max_sigma_mm) {
    result.reason = RejectReason::kPoorGeometry;
    return result;
  }
  result.point = point;
  return result;
}

// Consensus, refinement, and the choice of inliers again at the refined point until it stays.
NodeResult TriangulateNode(std::span<const Sight> sights, const TriangulationOptions& options,
                           uint64_t seed) {
  NodeResult result;
  result.views = DistinctCameras(sights);
  if (result.views == 2 && options.consensus.min_views > 2 && options.two_view.accept) {
    return TriangulatePair(sights, options, seed);
  }
  if (result.views < options.consensus.min_views) return result;
  result.reason = RejectReason::kNoConsensus;
  Consensus consensus = FindConsensus(sights, options.consensus, seed);
  if (consensus.inliers.empty()) return result;

  std::optional<RefinedPoint> point;
  std::vector<int> inliers = std::move(consensus.inliers), next;
  Eigen::Vector3d start = consensus.position_mm;
  for (int round = 0; round < kMaxRefinementRounds; ++round) {
    point = RefinePoint(start, sights, inliers, options.refinement);
    if (!point) {
      result.reason = RejectReason::kPoorGeometry;
      return result;
    }
    InliersAt(point->position_mm, sights, options.consensus, &next);
    if (static_cast<int>(next.size()) < options.consensus.min_views) return result;
    if (next == inliers) break;
    inliers.swap(next);
    start = point->position_mm;
  }
  result.point = point;
  result.views = static_cast<int>(inliers.size());
  return result;
}

// Residuals beyond those that the three unknowns absorb.
int SpareResiduals(const NodeResult& result) { return 2 * result.views - 3; }

// Common scatter of the frame: chi-square per spare residual, over all points. At least 1, since sigmas that
// are too large are no evidence that the geometry is better than they say.
double FrameVarianceFactor(const std::vector<NodeResult>& results) {
  double chi_square = 0, spare = 0;
  for (const NodeResult& result : results) {
    if (!result.point || result.views < 3) continue;  // pairs were chosen by their misclosure
    chi_square += result.point->chi_square;
    spare += SpareResiduals(result);
  }
  return spare > 0 ? std::max(1.0, chi_square / spare) : 1.0;
}

Cloud Collect(const NodeIndex& index, const std::vector<NodeResult>& results,
              const TriangulationOptions& options) {
  const double frame_factor = FrameVarianceFactor(results);
  const double prior = options.refinement.variance_prior_residuals;
  Cloud cloud;
  for (size_t i = 0; i < results.size(); ++i) {
    const NodeResult& result = results[i];
    if (!result.point) {
      cloud.rejected.push_back({index.nodes[i].node, result.views, result.reason});
      continue;
    }
    CloudPoint point;
    const double own = result.point->chi_square + prior * frame_factor;
    const double factor = std::max(1.0, own / (SpareResiduals(result) + prior));
    point.position_mm = result.point->position_mm;
    point.covariance_mm2 = factor * result.point->covariance_mm2;
    point.sigma_mm = std::sqrt(point.covariance_mm2.trace() / 3);
    point.node = index.nodes[i].node;
    point.views = result.views;
    if (point.sigma_mm > options.refinement.max_sigma_mm) {
      cloud.rejected.push_back({point.node, point.views, RejectReason::kPoorGeometry});
    } else {
      cloud.points.push_back(point);
    }
  }
  return cloud;
}

// A seed of the node's own, so that neither order nor thread count matters.
uint64_t SeedOf(const BoardNode& node, uint64_t seed) {
  return seed ^ (static_cast<uint64_t>(node.kind) << 56 | static_cast<uint64_t>(node.row) << 28 |
                 static_cast<uint64_t>(node.col));
}

}  // namespace

absl::Status ConsensusOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("triangulation.consensus.", what));
  };
  if (!(inlier_radius_mm > 0)) return bad("inlier_radius_mm must be positive");
  if (!(max_residual_sigmas > 0)) return bad("max_residual_sigmas must be positive");
  if (!(min_residual_px >= 0)) return bad("min_residual_px must not be negative");
  if (min_views < 2) return bad("min_views must be at least 2");
  if (max_hypotheses < 1) return bad("max_hypotheses must be at least 1");
  if (!(min_pair_angle_deg >= 0 && min_pair_angle_deg < 90))
    return bad("min_pair_angle_deg must lie in 0 to 90");
  if (!(confidence > 0 && confidence < 1)) return bad("confidence must lie between 0 and 1");
  return absl::OkStatus();
}

absl::Status RefinementOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("triangulation.refinement.", what));
  };
  if (max_iterations < 1) return bad("max_iterations must be at least 1");
  if (!(tolerance_mm > 0)) return bad("tolerance_mm must be positive");
  if (!(huber_sigmas > 0)) return bad("huber_sigmas must be positive");
  if (!(min_sigma_px > 0)) return bad("min_sigma_px must be positive");
  if (!(calibration_sigma_px >= 0)) return bad("calibration_sigma_px must not be negative");
  if (!(max_sigma_mm > 0)) return bad("max_sigma_mm must be positive");
  if (!(variance_prior_residuals > 0)) return bad("variance_prior_residuals must be positive");
  return absl::OkStatus();
}

absl::Status TwoViewOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("triangulation.two_view.", what));
  };
  if (!(min_angle_deg >= 0 && min_angle_deg < 90)) return bad("min_angle_deg must lie in 0 to 90");
  if (!(max_residual_sigmas > 0)) return bad("max_residual_sigmas must be positive");
  if (!(max_sigma_mm > 0)) return bad("max_sigma_mm must be positive");
  return absl::OkStatus();
}

absl::Status TriangulationOptions::Validate() const {
  if (absl::Status status = consensus.Validate(); !status.ok()) return status;
  if (absl::Status status = two_view.Validate(); !status.ok()) return status;
  return refinement.Validate();
}

absl::StatusOr<Cloud> Triangulate(const Rig& rig, const std::vector<ViewObservations>& views,
                                  const TriangulationOptions& options) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  if (absl::Status status = CheckViews(rig, views); !status.ok()) return status;

  std::vector<std::vector<UndistortedPoint>> undistorted(views.size());
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t v) {
    undistorted[v] = UndistortAll(rig.cameras[views[v].camera], views[v].observations);
  });
  const NodeIndex index = GroupByNode(views);
  std::vector<NodeResult> results(index.nodes.size());
  const tbb::blocked_range<size_t> all(0, index.nodes.size(), kNodesPerTask);
  tbb::parallel_for(all, [&](const tbb::blocked_range<size_t>& range) {
    std::vector<Sight> sights;
    for (size_t i = range.begin(); i < range.end(); ++i) {
      sights.clear();
      for (size_t e = index.nodes[i].first; e < index.nodes[i].last; ++e) {
        const auto [view, observation] = index.entries[e];
        const UndistortedPoint& point = undistorted[view][observation];
        if (!point.valid) continue;
        const int camera = views[view].camera;
        sights.push_back(
            MakeSight(rig.cameras[camera], camera, point, views[view].observations[observation].sigma_px));
      }
      results[i] = TriangulateNode(sights, options, SeedOf(index.nodes[i].node, options.consensus.seed));
    }
  });
  return Collect(index, results, options);
}

}  // namespace weft
