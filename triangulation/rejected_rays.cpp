#include "triangulation/rejected_rays.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "triangulation/sight.h"

namespace weft {
namespace {

auto OrderOf(const BoardNode& node) { return std::tuple(node.kind, node.row, node.col); }

// Pixels per radian, the mean of both axes of the image.
double PixelsPerRad(const Sight& sight) {
  const Eigen::Matrix<double, 2, 3>& j = sight.pixel_from_offset;
  return std::sqrt((j * j.transpose()).trace() / 2) / std::pow(sight.axis.dot(sight.direction), 1.5);
}

}  // namespace

std::vector<CloudRay> RaysOfRejected(const Rig& rig, const std::vector<ViewObservations>& views,
                                     const Cloud& cloud, const RefinementOptions& options) {
  const auto is_rejected = [&](const BoardNode& node) {
    const auto at = std::lower_bound(
        cloud.rejected.begin(), cloud.rejected.end(), node,
        [](const RejectedNode& r, const BoardNode& n) { return OrderOf(r.node) < OrderOf(n); });
    return at != cloud.rejected.end() && at->node == node;
  };
  std::vector<CloudRay> rays;
  for (const ViewObservations& view : views) {
    std::vector<Observation> chosen;
    for (const Observation& o : view.observations)
      if (is_rejected(o.node)) chosen.push_back(o);
    const CameraModel& camera = rig.cameras[view.camera];
    const std::vector<UndistortedPoint> points = UndistortAll(camera, chosen);
    const double of_camera_px = options.camera_sigma_px.empty() ? 0 : options.camera_sigma_px[view.camera];
    for (size_t i = 0; i < chosen.size(); ++i) {
      if (!points[i].valid) continue;
      const Sight sight = MakeSight(camera, view.camera, points[i], chosen[i].sigma_px);
      const double sigma_px = std::hypot(std::max(sight.sigma_px, options.min_sigma_px),
                                         options.calibration_sigma_px, of_camera_px);
      rays.push_back({chosen[i].node, sight.origin_mm, sight.direction, sigma_px / PixelsPerRad(sight)});
    }
  }
  std::stable_sort(rays.begin(), rays.end(),
                   [](const CloudRay& a, const CloudRay& b) { return OrderOf(a.node) < OrderOf(b.node); });
  return rays;
}

}  // namespace weft
