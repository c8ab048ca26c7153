#include <cmath>

#include "capture/calibration/covisibility.h"
#include "services/studio/calibration/calibrate_dump.h"

namespace weft {
namespace {

void AddCameras(const CalibrationResult& result, v1::CalibrationReport& proto) {
  const CalibrationViews& views = result.detection.views;
  const std::vector<int> shared = SharedViews(views);
  for (size_t c = 0; c < views.cameras.size(); ++c) {
    v1::CalibrationReport::Camera& camera = *proto.add_cameras();
    const CameraSightings& sightings = result.detection.sightings[c];
    camera.set_id(views.cameras[c].id);
    camera.set_images(sightings.images);
    camera.set_blurred_tags(sightings.blurred_tags);
    camera.set_small_tags(sightings.small_tags);
    camera.set_unclear_tags(sightings.unclear_tags);
    camera.set_shared_views(shared[c]);
    for (const BoardView& view : views.boards)
      camera.set_views(camera.views() + (view.camera == static_cast<int>(c)));
    for (const int corners : CornerCoverage(views, static_cast<int>(c))) camera.add_coverage(corners);
    if (!result.solution) continue;
    const CameraFit& fit = result.solution->cameras[c];
    camera.set_corners(fit.corners);
    camera.set_rejected_corners(fit.rejected_corners);
    camera.set_corner_sigma_px(fit.sigma_px);
    camera.set_rms_px(fit.rms_px);
    if (std::isfinite(fit.projection_sigma_px)) camera.set_projection_sigma_px(fit.projection_sigma_px);
  }
}

}  // namespace

v1::CalibrationReport CalibrationMessage(const CalibrationResult& result) {
  v1::CalibrationReport proto;
  proto.set_accepted(result.issues.empty());
  *proto.mutable_verdict() = CalibrationVerdict(result);
  for (const CalibrationIssue& issue : result.issues) {
    v1::CalibrationReport::Issue& to = *proto.add_issues();
    to.set_fault(CalibrationFaultName(issue.fault));
    for (const int camera : issue.cameras) to.add_cameras(result.detection.views.cameras[camera].id);
    to.set_message(issue.message);
  }
  AddCameras(result, proto);
  proto.set_frames(static_cast<int>(result.detection.views.frames.size()));
  proto.set_detection_s(result.detection_s);
  proto.set_solution_s(result.solution_s);
  if (result.solution) {
    const CalibrationSolution& solution = *result.solution;
    for (size_t b = 0; b < solution.bundle.warps.size(); ++b) {
      const BoardWarp& warp = solution.bundle.warps[b];
      v1::CalibrationReport::Warp& to = *proto.add_warps();
      to.set_board(solution.bundle.boards[b].id);
      to.set_bend_xx_mm(warp.bend_xx_mm);
      to.set_bend_xy_mm(warp.bend_xy_mm);
      to.set_bend_yy_mm(warp.bend_yy_mm);
      to.set_stretch(warp.stretch);
    }
    for (const ScaleBarFit& fit : solution.bars) {
      v1::CalibrationReport::MeasuredBar& to = *proto.add_bars();
      to.set_id(result.target.scale_bars[fit.bar].id);
      to.set_length_mm(result.target.scale_bars[fit.bar].length_mm);
      to.set_measured_mm(fit.length_mm);
      to.set_sigma_mm(fit.sigma_mm);
      to.set_frames(fit.frames);
    }
    proto.set_rms_px(solution.rms_px);
    proto.set_variance_factor(solution.variance_factor);
    proto.set_rig_hash(result.rig.ContentHash());
  }
  return proto;
}

}  // namespace weft
