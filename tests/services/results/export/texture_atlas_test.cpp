#include "services/results/export/texture_atlas.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

namespace weft {
namespace {

constexpr int kSidePx = 200, kAtlasPx = 64;

// Looks along +z from (x, 0, 0); 1 mm at 1000 mm is 1 px.
CameraModel CameraAt(double x_mm) {
  CameraModel camera;
  camera.id = "c";
  camera.width_px = camera.height_px = kSidePx;
  camera.fx_px = camera.fy_px = 1000;
  camera.cx_px = camera.cy_px = 100;
  camera.translation_mm = {-x_mm, 0, 0};
  return camera;
}

// A square from -50 to 50 mm at 1000 mm; u runs with x, v against y, which points down.
const std::vector<Eigen::Vector3d> kSquare_mm = {
    {-50, -50, 1000}, {50, -50, 1000}, {50, 50, 1000}, {-50, 50, 1000}};
const std::vector<Face> kSquareFaces = {{0, 2, 1}, {0, 3, 2}};

MeshTexture SquareTexture() {
  MeshTexture texture;
  texture.of_vertex = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  return texture;
}

// Red rises with x, green with y; blue is constant.
Frame Gradient(uint8_t blue) {
  auto pixels = std::make_shared<std::vector<uint8_t>>();
  for (int y = 0; y < kSidePx; ++y)
    for (int x = 0; x < kSidePx; ++x)
      pixels->insert(pixels->end(), {static_cast<uint8_t>(x), static_cast<uint8_t>(y), blue});
  Frame frame;
  frame.width_px = frame.height_px = kSidePx;
  frame.format = PixelFormat::kRgb8;
  frame.pixels = std::move(pixels);
  return frame;
}

std::array<int, 4> TexelAt(const AtlasPicture& picture, int x, int y) {
  const uint8_t* texel = &picture.rgba[4 * (static_cast<size_t>(y) * picture.size_px + x)];
  return {texel[0], texel[1], texel[2], texel[3]};
}

class TextureAtlasTest : public ::testing::Test {
 protected:
  TextureAtlas atlas_ = *TextureAtlas::Make(kAtlasPx, kSquareFaces, SquareTexture());
  VisibleMesh mesh_ = *VisibleMesh::Build(kSquare_mm, kSquareFaces, 1);
};

TEST_F(TextureAtlasTest, TexelsHaveTheColourOfTheirPixels) {
  ASSERT_TRUE(atlas_.Add(Gradient(7), mesh_, CameraAt(0)).ok());
  const AtlasPicture picture = atlas_.Take();
  EXPECT_EQ(picture.covered, 1);
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(10, 50), std::pair(63, 63)}) {
    const std::array<int, 4> texel = TexelAt(picture, x, y);
    EXPECT_NEAR(texel[0], 50 + 100 * (x + 0.5) / kAtlasPx, 0.51);
    EXPECT_NEAR(texel[1], 50 + 100 * (y + 0.5) / kAtlasPx, 0.51);
    EXPECT_EQ(texel[2], 7);
    EXPECT_EQ(texel[3], 255);
  }
}

TEST_F(TextureAtlasTest, CamerasInFrontCountMoreThanThoseAtTheSide) {
  CameraModel side = CameraAt(0);
  side.rotation = Eigen::AngleAxisd(-1, Eigen::Vector3d::UnitY()).toRotationMatrix().transpose();
  const Eigen::Vector3d center = Eigen::Vector3d(0, 0, 1000) - 1000 * side.rotation.row(2).transpose();
  side.translation_mm = -side.rotation * center;
  ASSERT_TRUE(atlas_.Add(Gradient(0), mesh_, CameraAt(0)).ok());
  ASSERT_TRUE(atlas_.Add(Gradient(200), mesh_, side).ok());
  const int blue = TexelAt(atlas_.Take(), 32, 32)[2];
  EXPECT_GT(blue, 0);
  EXPECT_LT(blue, 30);
}

TEST_F(TextureAtlasTest, IsEmptyWhereNoCameraLooks) {
  CameraModel away = CameraAt(0);
  away.rotation = Eigen::Vector3d(-1, 1, -1).asDiagonal();
  ASSERT_TRUE(atlas_.Add(Gradient(0), mesh_, away).ok());
  const AtlasPicture picture = atlas_.Take();
  EXPECT_EQ(picture.covered, 0);
  EXPECT_EQ(TexelAt(picture, 32, 32)[3], 0);
}

TEST(FilledRgbTest, KeepsWhatIsSeenAndFillsTheRestFromAround) {
  constexpr int kOddSide = 37;  // no power of two
  AtlasPicture picture{kOddSide, std::vector<uint8_t>(4 * kOddSide * kOddSide), 0};
  const auto is_seen = [](int x) { return x < 5 || x > 30; };
  for (int y = 0; y < kOddSide; ++y)
    for (int x = 0; x < kOddSide; ++x)
      if (is_seen(x)) {
        uint8_t* texel = &picture.rgba[4 * (y * kOddSide + x)];
        texel[0] = x < 5 ? 100 : 200;
        texel[1] = static_cast<uint8_t>(y);
        texel[3] = 255;
      }
  const std::vector<uint8_t> rgb = FilledRgb(picture);
  ASSERT_EQ(rgb.size(), 3u * kOddSide * kOddSide);
  for (int y = 0; y < kOddSide; ++y) {
    for (int x = 0; x < kOddSide; ++x) {
      const uint8_t* texel = &rgb[3 * (y * kOddSide + x)];
      EXPECT_EQ(texel[2], 0);
      if (is_seen(x)) {
        EXPECT_EQ(texel[0], x < 5 ? 100 : 200);
        EXPECT_EQ(texel[1], y);
      } else {
        EXPECT_GE(texel[0], 100);
        EXPECT_LE(texel[0], 200);
      }
    }
  }
  EXPECT_NEAR(rgb[3 * (18 * kOddSide + 7)], 100, 20);
  EXPECT_NEAR(rgb[3 * (18 * kOddSide + 28)], 200, 20);
}

TEST(TextureAtlasMake, RefusesSizesAndMeshesWithoutTexture) {
  EXPECT_FALSE(TextureAtlas::Make(0, kSquareFaces, SquareTexture()).ok());
  EXPECT_THAT(TextureAtlas::Make(8, kSquareFaces, {}).status().message(),
              ::testing::HasSubstr("no texture coordinates"));
}

}  // namespace
}  // namespace weft
