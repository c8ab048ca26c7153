#include "services/results/export/garment_texture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/image/image_encoders.h"
#include "tests/services/results/export/filmed_result.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Noise is what deflate packs worst.
TEST(GarmentTextureTest, NoPngIsLargerThanItsBound) {
  uint64_t state = 1;
  for (const int size_px : {1, 2, 17, 256}) {
    std::vector<uint8_t> rgb(3 * static_cast<size_t>(size_px) * static_cast<size_t>(size_px));
    for (uint8_t& value : rgb) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      value = static_cast<uint8_t>(state >> 56);
    }
    const auto png = EncodePng({size_px, size_px, 3, 8, rgb}, PngEffort::kSmall);
    ASSERT_TRUE(png.ok()) << png.status();
    EXPECT_LE(png->size(), MaxPngBytes(size_px)) << size_px;
  }
}

TEST(GarmentTextureTest, FramesForATextureAreSpreadEvenlyFromTheFirst) {
  const SmallResult result;
  const auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_THAT(MeshesForTexture(*source, 1), ElementsAre(0));
  EXPECT_THAT(MeshesForTexture(*source, 2), ElementsAre(0, 1));
  EXPECT_THAT(MeshesForTexture(*source, 3), ElementsAre(0, 1, 2));
  EXPECT_THAT(MeshesForTexture(*source, 8), ElementsAre(0, 1, 2));
}

TEST(GarmentTextureTest, ASequenceFilmedInOneColourHasATextureOfThatColour) {
  FilmedResult filmed;
  filmed.request.format = ExportFormat::kGlb;
  filmed.request.unit = LengthUnit::kMetre;
  filmed.request.recording = filmed.recording;
  filmed.request.texture_px = 32;
  filmed.request.texture_frames = 2;
  const auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  std::vector<std::pair<size_t, size_t>> steps;
  std::vector<std::string> warnings;
  const auto png = MakeSequenceTexture(
      filmed.request, *source,
      [&steps](ExportStep step, size_t done, size_t all) {
        EXPECT_EQ(step, ExportStep::kTexture);
        steps.emplace_back(done, all);
      },
      {}, warnings);
  ASSERT_TRUE(png.ok()) << png.status();
  EXPECT_THAT(steps, ElementsAre(std::pair(1, 2), std::pair(2, 2)));
  EXPECT_TRUE(warnings.empty()) << warnings.front();
  WriteBytes(filmed.folder / "texture.png", *png);
  const auto texture = ReadImageFile(filmed.folder / "texture.png");
  ASSERT_TRUE(texture.ok()) << texture.status();
  EXPECT_EQ(texture->width_px, 32);
  EXPECT_EQ(texture->height_px, 32);
  // Also outside of the garment's half of the picture, which is filled.
  for (const int y : {0, 15, 31})
    for (int channel = 0; channel < 3; ++channel)
      EXPECT_NEAR(texture->row(y)[3 * 16 + channel], FilmedResult::kColor[static_cast<size_t>(channel)], 1);
}

TEST(GarmentTextureTest, PicturesThatAreMissingAreWarnedOf) {
  FilmedResult filmed;
  filmed.request.format = ExportFormat::kGlb;
  filmed.request.unit = LengthUnit::kMetre;
  std::filesystem::remove(filmed.Picture(0, "c2"));
  auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const auto plan = PlanOverlays(filmed.recording, *source);
  ASSERT_TRUE(plan.ok()) << plan.status();
  auto atlas = TextureAtlas::Make(16, source->topology().faces, source->topology().texture);
  ASSERT_TRUE(atlas.ok()) << atlas.status();
  std::vector<std::string> warnings;
  ASSERT_TRUE(AddFrameToAtlas(*plan, *source, 0, *atlas, warnings).ok());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], ::testing::StartsWith("Frame 0000, camera c2: "));
  EXPECT_EQ(atlas->Take().covered, 1);  // by the other camera
}

TEST(GarmentTextureTest, WhatNoCameraSeesIsTold) {
  FilmedResult filmed;
  filmed.request.format = ExportFormat::kGlb;
  filmed.request.unit = LengthUnit::kMetre;
  // Cameras below the square, which see the inside of its faces.
  for (CameraModel& camera : filmed.rig.cameras) camera.rotation.setIdentity();
  ASSERT_TRUE(WriteRig(filmed.recording.rig, filmed.rig).ok());
  filmed.request.recording = filmed.recording;
  filmed.request.texture_px = 16;
  const auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  std::vector<std::string> warnings;
  ASSERT_TRUE(MakeSequenceTexture(filmed.request, *source, nullptr, {}, warnings).ok());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("Cameras see 0.0 % of the texture"));
}

TEST(GarmentTextureTest, AStopIsCancelled) {
  FilmedResult filmed;
  filmed.request.format = ExportFormat::kGlb;
  filmed.request.unit = LengthUnit::kMetre;
  filmed.request.recording = filmed.recording;
  filmed.request.texture_px = 16;
  const auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  std::stop_source stop;
  stop.request_stop();
  std::vector<std::string> warnings;
  EXPECT_EQ(MakeSequenceTexture(filmed.request, *source, nullptr, stop.get_token(), warnings).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace weft
