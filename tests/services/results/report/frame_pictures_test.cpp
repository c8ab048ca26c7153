#include "services/results/report/frame_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "capture/image/image_file.h"
#include "services/results/report/mesh_colors.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// An upright sheet of side x side vertices, this large.
TriangleMesh UprightSheet(int side, double width_mm, double height_mm) {
  TriangleMesh sheet;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      sheet.vertices_mm.emplace_back(width_mm * j / (side - 1), height_mm * i / (side - 1), 0);
      if (i + 1 == side || j + 1 == side) continue;
      const int v = i * side + j;
      sheet.faces.push_back({v, v + side, v + 1});
      sheet.faces.push_back({v + 1, v + side, v + side + 1});
    }
  return sheet;
}

PicturedMesh SheetIn(const std::string& frame, const std::vector<VertexState>& states,
                     const std::vector<float>& sigmas_mm) {
  TriangleMesh sheet = UprightSheet(2, 100, 50);
  return {frame, "why " + frame, {sheet.vertices_mm, states, sigmas_mm, {3, 3, 3, 3}}, sheet.faces};
}

std::string SizesOf(const std::vector<MeshPicture>& pictures) {
  std::string text;
  for (const MeshPicture& picture : pictures)
    text += picture.title + " " + std::to_string(picture.width_px) + "x" + std::to_string(picture.height_px) +
            " " + picture.type + "\n";
  return text;
}

TEST(FramePictures, PicturesAreAsTallAsTheMeshAsks) {
  const auto sizes = [](double width_mm, double height_mm) {
    const auto pictures = DrawBothSides(UprightSheet(2, width_mm, height_mm), PlainColors(4), 1);
    EXPECT_TRUE(pictures.ok()) << pictures.status();
    return SizesOf(*pictures);
  };
  EXPECT_EQ(sizes(100, 50), "Front 480x254 image/png\nBack 480x254 image/png\n");
  EXPECT_EQ(sizes(100, 100), "Front 480x508 image/png\nBack 480x508 image/png\n");
  EXPECT_EQ(sizes(100, 10), "Front 480x200 image/png\nBack 480x200 image/png\n") << "at least";
  EXPECT_EQ(sizes(100, 400), "Front 480x620 image/png\nBack 480x620 image/png\n") << "at most";
}

TEST(FramePictures, NoisyColoursAreAJpegOnWhite) {
  constexpr int kSide = 320;
  const TriangleMesh sheet = UprightSheet(kSide, 100, 100);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(0, 1);
  std::vector<Eigen::Vector3f> colors(sheet.vertices_mm.size());
  for (Eigen::Vector3f& color : colors) color = {any(random), any(random), any(random)};
  const auto pictures = DrawBothSides(sheet, colors, 0);
  ASSERT_TRUE(pictures.ok()) << pictures.status();
  EXPECT_EQ(SizesOf(*pictures), "Front 480x508 image/jpeg\nBack 480x508 image/jpeg\n");
  const TempFolder folder;
  WriteBytes(folder / "front.jpg", pictures->front().bytes);
  const auto shown = ReadImageFile(folder / "front.jpg");
  ASSERT_TRUE(shown.ok()) << shown.status();
  double mean = 0;
  for (int x = 100; x < 380; ++x) mean += shown->row(250)[3 * x + 1] / 280.0;
  EXPECT_NEAR(mean, 150, 15) << "the mean of the light";
  for (int channel = 0; channel < 3; ++channel) EXPECT_GT(shown->row(1)[3 * 240 + channel], 250);
}

TEST(FramePictures, AllFramesHaveOneRangeOfWhatWasObserved) {
  using enum VertexState;
  std::vector<std::string> notes;
  const auto frames =
      DrawFrames({SheetIn("1", {kObserved, kObserved, kInferred, kTwoView}, {0.1F, 0.1F, 9, 9}),
                  SheetIn("2", {kObserved, kDriven, kInferred, kInferred}, {0.1F, 0.4F, 9, 9})},
                 notes);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_TRUE(notes.empty());
  for (const FramePictures& frame : frames) {
    EXPECT_EQ(frame.why_shown, "why " + frame.frame);
    EXPECT_EQ(frame.sigma_range_mm.high, 0.4);
    EXPECT_EQ(SizesOf(frame.by_state), "Front 480x254 image/png\nBack 480x254 image/png\n");
    EXPECT_EQ(SizesOf(frame.by_sigma), SizesOf(frame.by_state));
    EXPECT_NE(frame.by_sigma[0].bytes, frame.by_state[0].bytes);
    EXPECT_TRUE(frame.in_images.empty());
  }
  EXPECT_EQ(frames[0].frame, "1");
  EXPECT_FALSE(frames[0].is_driven);
  EXPECT_TRUE(frames[1].is_driven);
}

TEST(FramePictures, FramesThatCannotBeDrawnAreNoted) {
  using enum VertexState;
  const std::vector<VertexState> states(4, kObserved);
  const std::vector<float> sigmas(4, 0.1F);
  PicturedMesh empty = SheetIn("1", states, sigmas), no_faces = SheetIn("3", states, sigmas);
  empty.mesh = {};
  no_faces.faces.clear();
  std::vector<std::string> notes;
  const auto frames = DrawFrames({empty, SheetIn("2", states, sigmas), no_faces}, notes);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].frame, "2");
  EXPECT_THAT(notes, ElementsAre("Frame 1 has no picture: the mesh has no vertices",
                                 "Frame 3 has no picture: the mesh has no faces"));
}

// The same corner is on the left in front and on the right behind, and the viewpoint stays for all frames.
TEST(FramePictures, ViewpointsAreThoseOfTheFirstFrame) {
  using enum VertexState;
  const std::vector<VertexState> states(4, kObserved);
  const std::vector<float> sigmas(4, 0.1F);
  PicturedMesh turned = SheetIn("2", states, sigmas);
  for (Eigen::Vector3d& vertex : turned.mesh.vertices_mm) std::swap(vertex.x(), vertex.z());
  std::vector<std::string> notes;
  const auto frames = DrawFrames({SheetIn("1", states, sigmas), turned}, notes);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_NE(frames[0].by_state[0].bytes, frames[1].by_state[0].bytes) << "seen from its edge";
}

}  // namespace
}  // namespace weft
