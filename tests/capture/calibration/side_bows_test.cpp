#include "capture/calibration/side_bows.h"

#include <gmock/gmock.h>

#include <map>

#include "capture/calibration/tag_detection.h"
#include "simulation/board_renderer.h"
#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

// A bent board before a lens that bends lines, as it is found in its picture, with the bundle that says so.
struct BowedPicture {
  CalibrationBundle bundle;
  std::map<int, Eigen::Vector2d> true_px;

  Eigen::Vector2d MeanError() const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const BoardCorner& corner : bundle.views[0].corners)
      sum += corner.pixel_px - true_px.at(corner.index);
    return sum / static_cast<double>(bundle.views[0].corners.size());
  }
};

BowedPicture TakeBowed(const BoardWarp& warp, double tag_mm) {
  const CameraModel camera = SmallCamera();
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
  BowedPicture out;
  out.bundle = {moved.target.boards, {warp}, {camera}, {1.0}, moved.placements, {}};
  out.bundle.views = {{0, 0, found.boards[0].corners, found.boards[0].straight_sides}};
  const CalibrationViews seen = SeeTarget(moved, rig, {.noise_px = 0});
  for (const BoardCorner& corner : seen.boards.at(0).corners) out.true_px[corner.index] = corner.pixel_px;
  return out;
}

TEST(SideBows, ABentBoardShiftsItsCornersUntilTheyAreCorrected) {
  BowedPicture picture = TakeBowed({2.5, 0, 2.5, 0}, 24);
  const Eigen::Vector2d before = picture.MeanError();
  EXPECT_GT(before.norm(), 0.03);  // several times the noise of the mean
  CorrectSideBows(&picture.bundle);
  const Eigen::Vector2d after = picture.MeanError();
  EXPECT_LT(after.norm(), 0.2 * before.norm()) << before.transpose() << " became " << after.transpose();
  RecordProperty("before_px", std::to_string(before.norm()));
  RecordProperty("after_px", std::to_string(after.norm()));
}

TEST(SideBows, CorrectingAgainChangesNothing) {
  BowedPicture picture = TakeBowed({2.5, 0, 2.5, 0}, 24);
  CorrectSideBows(&picture.bundle);
  const std::vector<BoardCorner> once = picture.bundle.views[0].corners;
  CorrectSideBows(&picture.bundle);
  for (size_t i = 0; i < once.size(); ++i)
    EXPECT_LT((picture.bundle.views[0].corners[i].pixel_px - once[i].pixel_px).norm(), 1e-9);
}

TEST(SideBows, CornersThatWereNotFoundByTheirSidesStay) {
  BowedPicture picture = TakeBowed({2.5, 0, 2.5, 0}, 24);
  picture.bundle.views[0].straight_sides = false;
  const Eigen::Vector2d before = picture.MeanError();
  CorrectSideBows(&picture.bundle);
  EXPECT_EQ(picture.MeanError(), before);
}

// From pictures to poses: with corners as they were found the rig is several sigmas off.
TEST(SideBows, RenderedBentBoardsGiveARigWithinItsSigmas) {
  SimulatedCalibration truth;
  truth.rig = MakeStudioRig("studio", {.cameras = 3,
                                       .width_px = 480,
                                       .height_px = 400,
                                       .distance_mm = 1300,
                                       .around_deg = 60,
                                       .object_width_mm = 420,
                                       .object_height_mm = 350})
                  .value();
  const CalibrationTarget target{"target", {MakeBoard("A", 0, 4, 3, 46)}, {}};
  truth.moved =
      MoveTarget(target, truth.rig,
                 {.frames = 30, .reach_mm = {90, 70, 100}, .tilt_deg = 35, .bend_mm = 1.2, .seed = 5})
          .value();
  truth.views = SeeTarget(truth.moved, truth.rig, {});
  truth.views.boards.clear();
  const auto detector = TagDetector::Make({"tag36h11"}, {.min_module_px = 3}).value();
  for (int frame = 0; frame < 30; ++frame) {
    for (int camera = 0; camera < 3; ++camera) {
      const Frame image = RenderBoards(truth.moved, frame, truth.rig.cameras[camera], {}).value();
      AddSightings(target, camera, frame, detector->Detect(image)->tags, &truth.views);
    }
  }
  const auto chi_square = [&] {
    const auto solved = SolveCalibration(target, truth.views, std::nullopt, {});
    EXPECT_TRUE(solved.ok()) << solved.status();
    return solved.ok() ? Compare(*solved, truth).per_freedom() : 1e9;
  };
  const double corrected = chi_square();
  for (BoardView& view : truth.views.boards) view.straight_sides = false;
  const double as_found = chi_square();
  RecordProperty("chi_square", std::to_string(corrected));
  RecordProperty("chi_square_as_found", std::to_string(as_found));
  EXPECT_LT(corrected, 1.5) << as_found;
  EXPECT_GT(as_found, 1.5 * corrected);
}

}  // namespace
}  // namespace weft
