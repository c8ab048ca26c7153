// The page of a calibration.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/calibration/covisibility.h"
#include "services/results/report/page.h"
#include "services/studio/calibration/calibrate_dump.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {
namespace {

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr size_t kMostMarks = 160;  // of a camera

struct CornerMark {
  Eigen::Vector2d corner_px, residual_px = Eigen::Vector2d::Zero();
};

// Corners of one camera: those of the solution with their residuals, all where there is none.
std::vector<CornerMark> MarksOf(const CalibrationResult& result, int camera) {
  std::vector<CornerMark> marks;
  if (!result.solution) {
    for (const BoardView& view : result.detection.views.boards)
      for (const BoardCorner& corner : view.corners)
        if (view.camera == camera) marks.push_back({corner.pixel_px});
    return marks;
  }
  const CalibrationBundle& bundle = result.solution->bundle;
  for (const BundleView& view : bundle.views) {
    if (view.camera != camera) continue;
    const std::vector<Eigen::Vector2d> residuals_px = ViewResiduals(bundle, view);
    for (size_t i = 0; i < residuals_px.size(); ++i)
      marks.push_back({view.corners[i].pixel_px, residuals_px[i]});
  }
  return marks;
}

void AddMarks(const std::vector<CornerMark>& marks, v1::CalibrationPage::Camera& to) {
  const size_t step = std::max<size_t>(1, marks.size() / kMostMarks);  // spread over all of them
  for (size_t i = 0; i < marks.size(); i += step) {
    for (const double px : marks[i].corner_px) to.add_corners_px(static_cast<float>(px));
    for (const double px : marks[i].residual_px) to.add_residuals_px(static_cast<float>(px));
  }
}

void AddFit(const CameraFit& fit, const CameraModel& camera, v1::CalibrationPage::Camera& to) {
  const Eigen::Vector3d center_mm = camera.CenterWorld(), look = camera.rotation.row(2).transpose();
  to.set_views_used(fit.views);
  to.mutable_center_mm()->Assign(center_mm.begin(), center_mm.end());
  to.mutable_look()->Assign(look.begin(), look.end());
  for (const double value : {camera.fx_px, camera.cx_px, camera.cy_px, camera.distortion[0]})
    to.add_lens(value);
  if (fit.covariance.size() == 0) return;
  const Eigen::Array<double, 15, 1> sigmas = fit.covariance.diagonal().array().sqrt();
  for (const int i : {0, 2, 3, 4}) to.add_lens_sigmas(sigmas[i]);
  to.set_rotation_sigma_deg(sigmas.segment<3>(9).matrix().norm() * kDegPerRad);
  to.set_center_sigma_mm(sigmas.segment<3>(12).matrix().norm());
}

v1::CalibrationPage::Solution SolutionData(const CalibrationResult& result) {
  const CalibrationSolution& solution = *result.solution;
  const WorstCamera worst = WorstCameraOf(result);
  const Eigen::Vector3d &low_mm = solution.stage_low_mm, stage_mm = solution.stage_high_mm - low_mm;
  v1::CalibrationPage::Solution data;
  data.set_iterations(solution.iterations);
  data.set_converged(solution.converged);
  data.set_worst_camera(worst.id);
  data.set_worst_px(worst.sigma_px);
  data.mutable_stage_low_mm()->Assign(low_mm.begin(), low_mm.end());
  data.mutable_stage_mm()->Assign(stage_mm.begin(), stage_mm.end());
  data.set_rig_id(result.rig.id);
  data.set_rig_version(result.record.version);
  for (const BoardPlacement& placement : solution.bundle.placements)
    for (const double mm : placement.world_from_board.translation_mm)
      data.add_boards_mm(static_cast<float>(mm));
  return data;
}

v1::CalibrationPage PageOf(const CalibrationResult& result) {
  const CalibrationViews& views = result.detection.views;
  const Covisibility covisibility = CountSharedViews(views);
  v1::CalibrationPage page;
  page.set_headline(CalibrationHeadline(result));
  page.set_provenance(result.provenance);
  *page.mutable_unread() = {result.detection.warnings.begin(), result.detection.warnings.end()};
  for (size_t c = 0; c < views.cameras.size(); ++c) {
    v1::CalibrationPage::Camera& camera = *page.add_cameras();
    camera.set_width_px(views.cameras[c].width_px);
    camera.set_height_px(views.cameras[c].height_px);
    camera.set_tags(result.detection.sightings[c].tags);
    camera.mutable_shared()->Assign(covisibility.shared[c].begin(), covisibility.shared[c].end());
    AddMarks(MarksOf(result, static_cast<int>(c)), camera);
    if (result.solution) AddFit(result.solution->cameras[c], result.solution->bundle.cameras[c], camera);
  }
  for (const TagBoard& board : result.target.boards) {
    v1::CalibrationPage::Board& to = *page.add_boards();
    to.set_id(board.id);
    to.set_rows(board.rows);
    to.set_cols(board.cols);
    to.set_tag_mm(board.tag_mm);
  }
  if (result.solution) *page.mutable_solution() = SolutionData(result);
  return page;
}

}  // namespace

std::string MakeCalibrationReport(const CalibrationResult& result) {
  const v1::CalibrationReport report = CalibrationMessage(result);
  const v1::CalibrationPage page = PageOf(result);
  return MakePage({.title = "Weft rig calibration",
                   .kind = "calibration",
                   .data = {{"report", &report}, {"page", &page}}});
}

}  // namespace weft
