#include "triangulation/triangulate.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "triangulation/group_solver.h"
#include "triangulation/ray_groups.h"

namespace weft {
namespace {

// Weight, in residuals, of the frame's scatter against the node's own; a node of three views has three
// residuals to spare, too few to judge its own.
constexpr double kVariancePriorResiduals = 8;

using SolvedBlocks = std::vector<std::vector<NodeResult>>;

// Residuals beyond those that the three unknowns absorb.
int SpareResiduals(const NodeResult& result) { return 2 * result.views - 3; }

// Common scatter of the frame: chi-square per spare residual, over all points.
double FrameScatter(const SolvedBlocks& blocks) {
  double chi_square = 0, spare = 0;
  for (const auto& block : blocks) {
    for (const NodeResult& result : block) {
      if (!result.point || result.views < 3) continue;  // pairs were chosen by their misclosure
      chi_square += result.point->chi_square;
      spare += SpareResiduals(result);
    }
  }
  return spare > 0 && chi_square > 0 ? chi_square / spare : 1.0;
}

Cloud Collect(const SolvedBlocks& blocks, const TriangulationOptions& options) {
  const double frame_scatter = FrameScatter(blocks);
  // Sigmas that are too large are no evidence that the geometry is better than they say.
  const double frame_factor = std::max(1.0, frame_scatter);
  const double prior = kVariancePriorResiduals;
  size_t points = 0;
  for (const auto& block : blocks) points += block.size();
  Cloud cloud;
  cloud.points.reserve(points);
  for (const auto& block : blocks) {
    for (const NodeResult& result : block) {
      if (!result.point) {
        cloud.rejected.push_back({result.node, result.views, result.reason});
        continue;
      }
      CloudPoint point;
      const double own =
          (result.point->chi_square + prior * frame_scatter) / (SpareResiduals(result) + prior);
      // A pair was chosen by its misclosure, which says nothing for it.
      const double relative = result.views < 3 ? std::max(1.0, own / frame_scatter) : own / frame_scatter;
      const double factor = frame_factor * relative;
      point.position_mm = result.point->position_mm;
      point.covariance_mm2 = factor * result.point->covariance_mm2;
      point.sigma_mm = std::sqrt(point.covariance_mm2.trace() / 3);
      point.node = result.node;
      point.views = result.views;
      if (point.sigma_mm > options.refinement.max_sigma_mm) {
        cloud.rejected.push_back({point.node, point.views, RejectReason::kPoorGeometry});
      } else {
        cloud.points.push_back(point);
      }
    }
  }
  return cloud;
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
  if (!(min_pair_angle_deg >= 0 && min_pair_angle_deg < 90))
    return bad("min_pair_angle_deg must lie in 0 to 90");
  return absl::OkStatus();
}

absl::Status RefinementOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("triangulation.refinement.", what));
  };
  if (!(huber_sigmas > 0)) return bad("huber_sigmas must be positive");
  if (!(min_sigma_px > 0)) return bad("min_sigma_px must be positive");
  if (!(calibration_sigma_px >= 0)) return bad("calibration_sigma_px must not be negative");
  for (const double sigma : camera_sigma_px)
    if (!(sigma >= 0)) return bad("camera_sigma_px must not be negative");
  if (!(min_angle_deg >= 0 && min_angle_deg < 90)) return bad("min_angle_deg must lie in 0 to 90");
  if (!(max_sigma_mm > 0)) return bad("max_sigma_mm must be positive");
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
  WEFT_RETURN_IF_ERROR(consensus.Validate());
  WEFT_RETURN_IF_ERROR(two_view.Validate());
  return refinement.Validate();
}

absl::StatusOr<Cloud> Triangulate(const Rig& rig, const std::vector<ViewObservations>& views,
                                  const TriangulationOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(const RayGroups groups, RayGroups::Build(rig, views, options));
  SolvedBlocks solved(groups.parts());
  std::atomic<bool> in_order = true;
  tbb::parallel_for(size_t{0}, groups.parts(), [&](size_t part) {
    RayGroup group;
    RayGroupReader reader(groups, part);
    GroupSolver solver(options, groups.cameras());
    solved[part].reserve(reader.most_observations());
    while (reader.in_order() && reader.Next(&group)) solver.Solve(group, &solved[part]);
    if (!reader.in_order()) in_order = false;
  });
  if (!in_order) {
    const absl::StatusOr<std::vector<ViewObservations>> sorted = InOrderOfGroups(rig, views);
    return sorted.ok() ? Triangulate(rig, *sorted, options) : sorted.status();
  }
  return Collect(solved, options);
}

}  // namespace weft
