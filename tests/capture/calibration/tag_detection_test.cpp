#include "capture/calibration/tag_detection.h"

#include <gmock/gmock.h>

#include <map>

#include "simulation/board_renderer.h"
#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

// One camera that sees one board, and where its corners are in truth.
struct Photograph {
  Rig rig;
  MovedTarget moved;
  Frame frame;
  std::map<int, Eigen::Vector2d> corners_px;  // by index
};

Photograph Take(const std::string& family, BoardLookOptions look, double roll_deg = 12) {
  Photograph out;
  const CameraModel camera = SmallCamera();
  out.rig.cameras = {camera};
  TagBoard board = MakeBoard("A", 0, 4, 3, 20);
  board.family = family;
  board.gap_mm = 20;
  out.moved.target.boards = {board};
  out.moved.warps = {{0.4, -0.2, 0.3, 1e-3}};
  RigidPose pose;
  pose.rotation = (Eigen::AngleAxisd(0.5, Eigen::Vector3d(0.6, 0.8, 0)) *
                   Eigen::AngleAxisd(roll_deg * 0.0174533, Eigen::Vector3d::UnitZ()))
                      .toRotationMatrix();
  pose.translation_mm = {5, -8, 330};
  out.moved.placements = {{0, 0, pose}};
  out.frame = RenderBoards(out.moved, 0, camera, look).value();
  const CalibrationViews views = SeeTarget(out.moved, out.rig, {.noise_px = 0});
  for (const BoardCorner& corner : views.boards.at(0).corners) out.corners_px[corner.index] = corner.pixel_px;
  return out;
}

CalibrationViews Detected(const Photograph& photo, const TagDetectionOptions& options = {}) {
  const auto detector = TagDetector::Make({photo.moved.target.boards[0].family}, options).value();
  const ImageTags tags = detector->Detect(photo.frame).value();
  CalibrationViews views;
  AddSightings(photo.moved.target, 0, 0, tags.tags, &views);
  return views;
}

class OfFamily : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(TagDetection, OfFamily, ::testing::Values("tag36h11", "tagStandard41h12"));

TEST_P(OfFamily, CornersAreFoundToAFewHundredthsOfAPixelWhicheverWayUp) {
  for (const double roll_deg : {12.0, 100.0, -95.0, 181.0}) {
    const Photograph photo = Take(GetParam(), {}, roll_deg);
    const CalibrationViews views = Detected(photo);
    ASSERT_EQ(views.boards.size(), 1u);
    EXPECT_EQ(views.boards[0].corners.size(), photo.corners_px.size());
    double sum = 0;
    for (const BoardCorner& corner : views.boards[0].corners) {
      const double error = (corner.pixel_px - photo.corners_px.at(corner.index)).norm();
      sum += error * error;
      EXPECT_LT(error, 0.3) << "corner " << corner.index << " at " << corner.pixel_px.transpose()
                            << ", off by "
                            << (corner.pixel_px - photo.corners_px.at(corner.index)).transpose();
    }
    const double rms = std::sqrt(sum / (2 * views.boards[0].corners.size()));
    RecordProperty("rms_px", std::to_string(rms));
    EXPECT_LT(rms, 0.06) << "roll " << roll_deg;
    EXPECT_NEAR(views.boards[0].blur_px, 0.75, 0.2);
  }
}

TEST(TagDetection, TonesOfTheCameraAreUndoneByGamma) {
  BoardLookOptions look;
  look.sensor.gamma = 2.2;
  look.lens.point_spread_sigma_px = 1.0;
  const Photograph photo = Take("tag36h11", look);
  const auto growth = [&](double gamma) {  // of the tags' diagonals, px
    const CalibrationViews views = Detected(photo, {.gamma = gamma});
    double sum = 0;
    std::map<int, Eigen::Vector2d> at;
    for (const BoardCorner& corner : views.boards.at(0).corners) at[corner.index] = corner.pixel_px;
    for (const auto& [index, pixel] : at) {
      if (index % 4 != 0) continue;
      sum += (pixel - at[index + 2]).norm() -
             (photo.corners_px.at(index) - photo.corners_px.at(index + 2)).norm();
    }
    return sum / (at.size() / 4.0);
  };
  EXPECT_LT(std::abs(growth(2.2)), 0.05);
  EXPECT_LT(growth(1), -0.2);  // blurred white runs over black
}

TEST(TagDetection, BlurredTagsAreRefusedAndCounted) {
  BoardLookOptions look;
  look.blur_along_px = 9;
  const Photograph photo = Take("tag36h11", look);
  const auto detector = TagDetector::Make({"tag36h11"}, {.max_blur_px = 1.3}).value();
  const ImageTags tags = detector->Detect(photo.frame).value();
  for (const TagSighting& tag : tags.tags) ADD_FAILURE() << tag.id << " passed with " << tag.blur_px << " px";
  EXPECT_GE(tags.blurred + tags.unclear, 6);
}

TEST(TagDetection, MirroredImagesShowNoTagsUntilMirroredBack) {
  Photograph photo = Take("tag36h11", {});
  photo.frame = MirroredGrey(photo.frame).value();
  EXPECT_TRUE(Detected(photo).boards.empty());
  photo.frame = MirroredGrey(photo.frame).value();
  EXPECT_EQ(Detected(photo).boards.size(), 1u);
}

TEST(TagDetection, TagsSeenTwiceCountAsNone) {
  TagSighting tag{"tag36h11", 3, {Eigen::Vector2d(0, 0), {10, 0}, {10, 10}, {0, 10}}, 0.7};
  CalibrationViews views;
  AddSightings({"t", {MakeBoard("A", 0)}, {}}, 0, 0, {tag, tag}, &views);
  EXPECT_TRUE(views.boards.empty());
}

TEST(TagDetection, EndsOfScaleBarsAreTheMiddlesOfTheirTags) {
  // A square in perspective: the diagonals meet away from the mean of the corners.
  TagSighting tag{"tag36h11", 7, {Eigen::Vector2d(0, 0), {4, 0}, {3, 2}, {1, 2}}, 0.7};
  CalibrationViews views;
  AddSightings({"t", {MakeBoard("A", 100)}, {{"bar", "tag36h11", 6, 7, 500}}}, 2, 5, {tag}, &views);
  ASSERT_EQ(views.bar_ends.size(), 1u);
  EXPECT_EQ(views.bar_ends[0].end, 1);
  EXPECT_LT((views.bar_ends[0].center_px - Eigen::Vector2d(2, 4.0 / 3)).norm(), 1e-9);
}

}  // namespace
}  // namespace weft
