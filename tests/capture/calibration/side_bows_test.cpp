#include "capture/calibration/side_bows.h"

#include <gmock/gmock.h>

#include <map>

#include "capture/calibration/tag_detection.h"
#include "simulation/board_renderer.h"
#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

// A bent board before a lens that bends lines, as it is found in its picture, with the bundle that says so.
struct Picture {
  CalibrationBundle bundle;
  std::map<int, Eigen::Vector2d> true_px;

  Eigen::Vector2d MeanError() const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const BoardCorner& corner : bundle.views[0].corners)
      sum += corner.pixel_px - true_px.at(corner.index);
    return sum / static_cast<double>(bundle.views[0].corners.size());
  }
};

Picture Take(const BoardWarp& warp, double tag_mm) {
  CameraModel camera;
  camera.id = "c";
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 800;
  camera.cx_px = 330;
  camera.cy_px = 225;
  camera.distortion = {-0.15, 0.05, 1e-3, -1e-3, 0};
  Rig rig;
  rig.cameras = {camera};
  MovedTarget moved;
  moved.target.boards = {MakeBoard("A", 0, 4, 3, tag_mm)};
  moved.warps = {warp};
  const RigidPose pose{
      (Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix(),
      {5, -8, 330}};
  moved.placements = {{0, 0, pose}};
  BoardLookOptions look;
  look.sensor.noise = false;
  look.samples = 8;
  const auto detector = TagDetector::Make({"tag36h11"}, {}).value();
  CalibrationViews found;
  AddSightings(moved.target, 0, 0, detector->Detect(RenderBoards(moved, 0, camera, look).value())->tags,
               &found);
  EXPECT_EQ(found.boards.size(), 1u);
  EXPECT_TRUE(found.boards[0].straight_sides);
  Picture out;
  out.bundle = {moved.target.boards, {warp}, {camera}, {1.0}, moved.placements, {}};
  out.bundle.views = {{0, 0, found.boards[0].corners, found.boards[0].straight_sides}};
  const CalibrationViews seen = SeeTarget(moved, rig, {.noise_px = 0});
  for (const BoardCorner& corner : seen.boards.at(0).corners) out.true_px[corner.index] = corner.pixel_px;
  return out;
}

TEST(SideBows, ABentBoardShiftsItsCornersUntilTheyAreCorrected) {
  Picture picture = Take({2.5, 0, 2.5, 0}, 24);
  const Eigen::Vector2d before = picture.MeanError();
  EXPECT_GT(before.norm(), 0.03);  // several times the noise of the mean
  CorrectSideBows(&picture.bundle);
  const Eigen::Vector2d after = picture.MeanError();
  EXPECT_LT(after.norm(), 0.2 * before.norm()) << before.transpose() << " became " << after.transpose();
  RecordProperty("before_px", std::to_string(before.norm()));
  RecordProperty("after_px", std::to_string(after.norm()));
}

TEST(SideBows, CorrectingAgainChangesNothing) {
  Picture picture = Take({2.5, 0, 2.5, 0}, 24);
  CorrectSideBows(&picture.bundle);
  const std::vector<BoardCorner> once = picture.bundle.views[0].corners;
  CorrectSideBows(&picture.bundle);
  for (size_t i = 0; i < once.size(); ++i)
    EXPECT_LT((picture.bundle.views[0].corners[i].pixel_px - once[i].pixel_px).norm(), 1e-9);
}

TEST(SideBows, CornersThatWereNotFoundByTheirSidesStay) {
  Picture picture = Take({2.5, 0, 2.5, 0}, 24);
  picture.bundle.views[0].straight_sides = false;
  const Eigen::Vector2d before = picture.MeanError();
  CorrectSideBows(&picture.bundle);
  EXPECT_EQ(picture.MeanError(), before);
}

}  // namespace
}  // namespace weft
