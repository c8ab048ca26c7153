#include "services/results/report/frame_overlays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Cameras that look around the vertical axis, by their angles.
Rig TurnedCameras(const std::vector<double>& angles_deg) {
  Rig rig;
  for (const double angle_deg : angles_deg) {
    CameraModel& camera = rig.cameras.emplace_back();
    camera.id = "c" + std::to_string(rig.cameras.size());
    camera.rotation = Eigen::AngleAxisd(angle_deg * M_PI / 180, Eigen::Vector3d::UnitY()).toRotationMatrix();
  }
  return rig;
}

void AddCells(const std::string& camera, int centers, v1::FrameReport& report) {
  v1::ViewReport& view = *report.add_views();
  view.set_camera(camera);
  view.set_centers(centers);
}

TEST(FrameOverlays, TheSecondCameraLooksFromAnotherSide) {
  const Rig rig = TurnedCameras({0, 50, 70, 180});
  v1::FrameReport report;
  AddCells("c1", 900, report);
  AddCells("c2", 800, report);
  AddCells("c4", 100, report);
  AddCells("c3", 200, report);
  EXPECT_THAT(CamerasToShow(rig, report), ElementsAre(0, 2));
}

TEST(FrameOverlays, CamerasThatReadNothingAreNotShown) {
  const Rig rig = TurnedCameras({0, 180});
  v1::FrameReport report;
  AddCells("c1", 0, report);
  AddCells("unknown", 50, report);
  EXPECT_THAT(CamerasToShow(rig, report), IsEmpty());
  AddCells("c2", 10, report);
  EXPECT_THAT(CamerasToShow(rig, report), ElementsAre(1));
}

TEST(FrameOverlays, RecordingsMayBeGone) {
  v1::Job job;
  EXPECT_TRUE(absl::IsNotFound(JobImages::Open(job).status()));
}

}  // namespace
}  // namespace weft
