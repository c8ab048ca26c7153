#include "evaluation/camera_errors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "triangulation/consensus.h"
#include "triangulation/node_index.h"
#include "triangulation/refine.h"
#include "triangulation/sight.h"

namespace weft {
namespace {

struct Residual {
  int camera = 0;
  bool agrees = false;
  double reprojection_px = 0;
  std::optional<Eigen::Vector2d> left_out_px;
};

std::vector<Residual> ResidualsAt(const CloudPoint& point, const std::vector<Sight>& sights,
                                  const TriangulationOptions& options) {
  std::vector<int> inliers;
  InliersAt(point.position_mm, sights, options.consensus, &inliers);
  std::vector<Residual> residuals;
  for (const Sight& sight : sights) residuals.push_back({.camera = sight.camera});
  for (const int i : inliers) {
    residuals[i].agrees = true;
    residuals[i].reprojection_px = sights[i].ResidualPx(point.position_mm).norm();
    if (static_cast<int>(inliers.size()) <= options.consensus.min_views) continue;
    std::vector<int> others;
    std::copy_if(inliers.begin(), inliers.end(), std::back_inserter(others), [i](int j) { return j != i; });
    const std::optional<RefinedPoint> without =
        RefinePoint(point.position_mm, sights, others, options.refinement);
    if (without && sights[i].DepthMm(without->position_mm) > 0)
      residuals[i].left_out_px = sights[i].ResidualPx(without->position_mm);
  }
  return residuals;
}

}  // namespace

absl::Status CameraErrorOptions::Validate() const {
  if (max_nodes < 1) return absl::InvalidArgumentError("max_nodes must be at least 1");
  if (!(sigma_px > 0)) return absl::InvalidArgumentError("sigma_px must be positive");
  return triangulation.Validate();
}

CameraErrors& CameraErrors::operator+=(const CameraErrors& other) {
  camera_id = other.camera_id;
  observations += other.observations, outliers += other.outliers;
  reprojection_px += other.reprojection_px;
  left_out_px += other.left_out_px;
  shift_sum_px += other.shift_sum_px;
  return *this;
}

absl::StatusOr<std::vector<CameraErrors>> MeasureCameraErrors(const Rig& rig,
                                                              std::vector<ViewObservations> views,
                                                              const Cloud& cloud,
                                                              const CameraErrorOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  const int cameras = static_cast<int>(rig.cameras.size());
  std::vector<std::vector<UndistortedPoint>> undistorted(views.size());
  for (const ViewObservations& view : views)
    if (view.camera < 0 || view.camera >= cameras)
      return absl::InvalidArgumentError(
          absl::StrCat("observations of camera ", view.camera, " of a rig with ", cameras));
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t i) {
    undistorted[i] = UndistortAll(rig.cameras[views[i].camera], views[i].observations);
  });
  const NodeIndex index = GroupByNode(views);
  std::map<BoardNode, const SeenNode*> seen;
  for (const SeenNode& node : index.nodes) seen[node.node] = &node;

  const size_t step = std::max<size_t>(1, cloud.points.size() / static_cast<size_t>(options.max_nodes));
  std::vector<std::vector<Residual>> residuals((cloud.points.size() + step - 1) / step);
  tbb::parallel_for(size_t{0}, residuals.size(), [&](size_t i) {
    const CloudPoint& point = cloud.points[i * step];
    const auto node = seen.find(point.node);
    if (node == seen.end()) return;
    std::vector<Sight> sights;
    for (size_t e = node->second->first; e < node->second->last; ++e) {
      const auto& [view, place] = index.entries[e];
      const double own_sigma = views[view].observations[place].sigma_px;
      if (undistorted[view][place].valid)
        sights.push_back(MakeSight(rig.cameras[views[view].camera], views[view].camera,
                                   undistorted[view][place], own_sigma > 0 ? own_sigma : options.sigma_px));
    }
    residuals[i] = ResidualsAt(point, sights, options.triangulation);
  });

  std::vector<CameraErrors> errors(cameras);
  for (int c = 0; c < cameras; ++c) errors[c].camera_id = rig.cameras[c].id;
  for (const auto& of_node : residuals) {
    for (const Residual& r : of_node) {
      CameraErrors& camera = errors[r.camera];
      ++camera.observations;
      if (!r.agrees) {
        ++camera.outliers;
        continue;
      }
      camera.reprojection_px.push_back(r.reprojection_px);
      if (!r.left_out_px) continue;
      camera.left_out_px.push_back(r.left_out_px->norm());
      camera.shift_sum_px += *r.left_out_px;
    }
  }
  return errors;
}

}  // namespace weft
