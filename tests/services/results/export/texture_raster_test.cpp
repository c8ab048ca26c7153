#include "services/results/export/texture_raster.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

// The lower left half of the texture: v rises, rows fall.
TEST(TextureRaster, TexelsKnowTheirPlaceInTheFace) {
  MeshTexture texture;
  texture.of_vertex = {{0, 0}, {1, 0}, {0, 1}};
  const std::vector<Face> faces = {Face{0, 1, 2}};
  const auto texels = RasterizeTexture(4, faces, texture, "--texture");
  ASSERT_TRUE(texels.ok()) << texels.status();
  EXPECT_EQ((*texels)[3].face, -1);  // upper right
  // The centre of the first texel of the last row is (1/8, 1/8).
  EXPECT_EQ((*texels)[12].face, 0);
  EXPECT_FLOAT_EQ((*texels)[12].weight_b, 0.125f);
  EXPECT_FLOAT_EQ((*texels)[12].weight_c, 0.125f);
}

TEST(TextureRaster, RefusesSizesAndMeshesThatHaveNoTexture) {
  MeshTexture texture;
  EXPECT_THAT(RasterizeTexture(4, {}, texture, "--texture").status().message(),
              HasSubstr("--texture: the meshes have no texture coordinates"));
  texture.of_vertex = {{0, 0}};
  EXPECT_THAT(RasterizeTexture(0, {}, texture, "--x").status().message(),
              HasSubstr("--x: must lie between 1"));
  EXPECT_FALSE(RasterizeTexture(kMaxAtlasPx + 1, {}, texture, "--x").ok());
}

TEST(TextureRaster, TheGutterIsFourTexelsWide) {
  std::vector<Eigen::Vector4f> values(100, Eigen::Vector4f::Zero());
  values[0] = {2, 4, 6, 2};
  AddGutter(10, values);
  EXPECT_EQ(values[44], Eigen::Vector4f(1, 2, 3, 1));  // 4 right, 4 down
  EXPECT_EQ(values[5], Eigen::Vector4f(0, 0, 0, 0));
  EXPECT_EQ(values[0], Eigen::Vector4f(2, 4, 6, 2));
}

}  // namespace
}  // namespace weft
