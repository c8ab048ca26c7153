#include "services/results/report/frame_overlays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <string>

#include "capture/image/image_file.h"
#include "services/formats/files/rig_file.h"
#include "tests/capture/temp_folder.h"

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

// A recording of two frames by three cameras that look along one axis, and the job that used it.
class RecordedJob {
 public:
  RecordedJob() : rig_(TurnedCameras({0, 180, 180})) {
    for (CameraModel& camera : rig_.cameras) {
      camera.width_px = 700, camera.height_px = 350;
      camera.fx_px = camera.fy_px = 1000, camera.cx_px = 350, camera.cy_px = 175;
      camera.translation_mm = {0, 0, 1000};
    }
    rig_.cameras[2].width_px = 100, rig_.cameras[2].height_px = 200;
    EXPECT_TRUE(WriteRig(folder_ / "rig.json", rig_).ok());
    for (const char* frame : {"0", "1"})
      for (const CameraModel& camera : rig_.cameras) WritePicture(frame, camera);
    job_.mutable_spec()->set_dump(folder_ / "take");
    job_.mutable_spec()->set_rig(folder_ / "rig.json");
  }

  void WritePicture(const std::string& frame, const CameraModel& camera) {
    Frame grey;
    grey.width_px = camera.width_px, grey.height_px = camera.height_px;
    grey.pixels = std::make_shared<std::vector<uint8_t>>(
        static_cast<size_t>(grey.width_px) * static_cast<size_t>(grey.height_px), uint8_t{90});
    std::filesystem::create_directories(folder_ / ("take/" + frame));
    EXPECT_TRUE(WriteImageFile(folder_ / ("take/" + frame + "/" + camera.id + ".png"), grey).ok());
  }

  JobImages Images() {
    auto images = JobImages::Open(job_);
    EXPECT_TRUE(images.ok()) << images.status();
    return *std::move(images);
  }

  // "c1 560x280, ".
  static std::string SizesOf(const std::vector<MeshPicture>& pictures) {
    std::string text;
    for (const MeshPicture& picture : pictures) {
      EXPECT_EQ(picture.type, "image/jpeg");
      EXPECT_EQ(picture.bytes.substr(0, 2), "\xFF\xD8");
      text += picture.title + " " + std::to_string(picture.width_px) + "x" +
              std::to_string(picture.height_px) + ", ";
    }
    return text;
  }

  TempFolder folder_;
  Rig rig_;
  v1::Job job_;
};

TEST(FrameOverlays, WhatIsNotThereOrAnotherRigIsNamed) {
  RecordedJob recorded;
  v1::Job job = recorded.job_;
  job.mutable_spec()->set_dump("/nowhere/take");
  EXPECT_EQ(JobImages::Open(job).status(), absl::NotFoundError("/nowhere/take: is not there any more"));
  job = recorded.job_;
  job.mutable_spec()->set_rig("/nowhere/rig.json");
  EXPECT_EQ(JobImages::Open(job).status(), absl::NotFoundError("/nowhere/rig.json: is not there any more"));
  job = recorded.job_;
  job.mutable_inputs()->set_rig("ab");
  EXPECT_EQ(JobImages::Open(job).status(),
            absl::FailedPreconditionError(job.spec().rig() + ": has hash " + recorded.rig_.ContentHash() +
                                          ", the job was computed with ab"));
  job.mutable_inputs()->set_rig(recorded.rig_.ContentHash());
  EXPECT_TRUE(JobImages::Open(job).ok());
}

TEST(FrameOverlays, PlainImagesAreOfTheCamerasThatReadMostOrTheFirst) {
  RecordedJob recorded;
  const JobImages images = recorded.Images();
  v1::FrameReport report;
  report.set_frame("1");
  EXPECT_EQ(RecordedJob::SizesOf(images.Plain(report)), "c1 560x280, c2 560x280, ") << "none read a cell";
  AddCells("c3", 5, report);
  EXPECT_EQ(RecordedJob::SizesOf(images.Plain(report)), "c3 100x200, c1 560x280, ");
  AddCells("c1", 4, report);
  EXPECT_EQ(RecordedJob::SizesOf(images.Plain(report)), "c3 100x200, c1 560x280, ");
  report.clear_views();
  AddCells("c1", 4, report);
  EXPECT_EQ(RecordedJob::SizesOf(images.Plain(report)), "c1 560x280, c2 560x280, ");
  report.set_frame("7");
  EXPECT_EQ(RecordedJob::SizesOf(images.Plain(report)), "") << "no such frame";
}

TEST(FrameOverlays, ImagesThatCannotBeReadAreLeftOut) {
  RecordedJob recorded;
  WriteBytes(recorded.folder_ / "take/1/c1.png", "no picture");
  const JobImages images = recorded.Images();
  v1::FrameReport report;
  report.set_frame("1");
  EXPECT_EQ(RecordedJob::SizesOf(images.Plain(report)), "c2 560x280, ");
  AddCells("c1", 5, report);
  AddCells("c2", 4, report);
  const PicturedMesh mesh{"1",
                          "",
                          {{{-50, -50, 0}, {50, -50, 0}, {0, 50, 0}},
                           std::vector<VertexState>(3, VertexState::kObserved),
                           {1, 1, 1},
                           {3, 3, 3}},
                          {{0, 1, 2}}};
  // 100 px and six of margin on each side.
  EXPECT_EQ(RecordedJob::SizesOf(images.Overlays(report, mesh)), "Camera c2 113x113, ");
  report.set_frame("0");
  EXPECT_EQ(RecordedJob::SizesOf(images.Overlays(report, mesh)), "Camera c1 113x113, Camera c2 113x113, ");
  report.set_frame("7");
  EXPECT_EQ(RecordedJob::SizesOf(images.Overlays(report, mesh)), "");
}

}  // namespace
}  // namespace weft
