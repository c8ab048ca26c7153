#include "services/results/export/export_textures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/results/export/filmed_result.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TextureRequest TextureOfFilmed(const FilmedResult& filmed) {
  TextureRequest request;
  request.result = filmed.request.result;
  request.out = filmed.folder / "out";
  request.texture_px = 32;
  request.recording = filmed.recording;
  return request;
}

TEST(ExportTexturesTest, CoarserMeshesAreForNormalMapsAlone) {
  TextureRequest request;
  request.texture_px = 64;
  EXPECT_TRUE(request.Validate().ok());
  request.max_vertices = 100;
  EXPECT_EQ(request.Validate().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(request.Validate().message()), StartsWith("--max-vertices: "));
  request.normal_map_px = 64;
  EXPECT_TRUE(request.Validate().ok());
  request.max_vertices = 0;
  EXPECT_THAT(std::string(request.Validate().message()), StartsWith("--normal-map: "));
}

TEST(ExportTexturesTest, EachFrameHasAPictureOfTheColoursThatCamerasSaw) {
  const FilmedResult filmed;
  const auto outcome = ExportTextures(TextureOfFilmed(filmed), nullptr, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_FALSE(outcome->was_complete);
  EXPECT_EQ(outcome->manifest.format(), "png");
  EXPECT_EQ(outcome->manifest.overlay(), "texture");
  EXPECT_EQ(outcome->manifest.texture_px(), 32);
  ASSERT_EQ(outcome->manifest.frames_size(), 3);
  for (const v1::ExportedFrame& frame : outcome->manifest.frames()) {
    EXPECT_EQ(frame.file(), frame.frame() + ".png");
    EXPECT_EQ(frame.normal_map(), "");
    const auto picture = ReadImageFile(filmed.folder / ("out/" + frame.file()));
    ASSERT_TRUE(picture.ok()) << picture.status();
    // The garment has the lower half: v from 0 to 0.5.
    const uint8_t* seen = picture->row(24) + 3 * 16;
    for (size_t channel = 0; channel < 3; ++channel) EXPECT_EQ(seen[channel], FilmedResult::kColor[channel]);
  }
  EXPECT_TRUE(std::filesystem::exists(filmed.folder / "out/export.json"));
}

TEST(ExportTexturesTest, TheSameRequestFindsItsExportComplete) {
  const FilmedResult filmed;
  ASSERT_TRUE(ExportTextures(TextureOfFilmed(filmed), nullptr, {}).ok());
  const auto again = ExportTextures(TextureOfFilmed(filmed), nullptr, {});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->was_complete);
  TextureRequest other = TextureOfFilmed(filmed);
  other.texture_px = 16;
  EXPECT_EQ(ExportTextures(other, nullptr, {}).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST(ExportTexturesTest, PicturesThatWereMadeBeforeAStopStay) {
  const FilmedResult filmed;
  std::stop_source stop;
  const auto stopped = ExportTextures(
      TextureOfFilmed(filmed),
      [&stop](ExportStep step, size_t, size_t) {
        if (step == ExportStep::kWrite) stop.request_stop();
      },
      stop.get_token());
  EXPECT_EQ(stopped.status().code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(std::filesystem::exists(filmed.folder / "out/0000.png"));
  EXPECT_FALSE(std::filesystem::exists(filmed.folder / "out/0001.png"));
  EXPECT_FALSE(std::filesystem::exists(filmed.folder / "out/export.json"));
  const std::string mark = "made before";
  WriteBytes(filmed.folder / "out/0000.png", mark);
  ASSERT_TRUE(ExportTextures(TextureOfFilmed(filmed), nullptr, {}).ok());
  EXPECT_EQ(ReadBytes(filmed.folder / "out/0000.png"), mark);
  EXPECT_TRUE(std::filesystem::exists(filmed.folder / "out/0002.png"));
}

TEST(ExportTexturesTest, NamesTheCameraOfAPictureThatIsMissing) {
  const FilmedResult filmed;
  std::filesystem::remove(filmed.Picture(2, "c1"));
  const auto outcome = ExportTextures(TextureOfFilmed(filmed), nullptr, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  ASSERT_EQ(outcome->warnings.size(), 1u);
  EXPECT_THAT(outcome->warnings[0], HasSubstr("Frame 0002, camera c1: "));
}

TEST(ExportTexturesTest, NormalMapsAreFilesOfTheirOwn) {
  const FilmedResult filmed;
  // A sheet of 5 x 5 vertices with a fold, so that a coarser mesh lacks something.
  std::vector<Face> faces;
  MeshTexture texture;
  RegisteredMesh mesh;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) {
      mesh.vertices_mm.emplace_back(25 * j, 12 * i, j % 2 == 1 ? 5 : 0);
      texture.of_vertex.emplace_back(0.25F * static_cast<float>(j), 0.25F * static_cast<float>(i));
      mesh.state.push_back(VertexState::kObserved), mesh.sigma_mm.push_back(0.1F), mesh.views.push_back(3);
      if (i == 4 || j == 4) continue;
      const int v = 5 * i + j;
      faces.push_back({v, v + 1, v + 6});
      faces.push_back({v, v + 6, v + 5});
    }
  for (int frame = 0; frame < SmallResult::kFrames; ++frame)
    ASSERT_TRUE(WriteRegisteredMesh(filmed.MeshFile(frame), mesh, faces, texture).ok());
  TextureRequest request = TextureOfFilmed(filmed);
  request.texture_px = 0, request.normal_map_px = 16, request.max_vertices = 8;
  const auto outcome = ExportTextures(request, nullptr, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(outcome->manifest.overlay(), "normal map");
  EXPECT_EQ(outcome->manifest.normal_map_px(), 16);
  EXPECT_EQ(outcome->manifest.max_vertices(), 8);
  EXPECT_EQ(outcome->manifest.frames(1).file(), "");
  EXPECT_EQ(outcome->manifest.frames(1).normal_map(), "0001.normal.png");
  const auto map = ReadImageFile(filmed.folder / "out/0001.normal.png");
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->width_px, 16);
  bool leans = false;
  for (int x = 0; x < 16; ++x) leans |= std::abs(map->row(8)[3 * x] - 128) > 10;
  EXPECT_TRUE(leans);
}

}  // namespace
}  // namespace weft
