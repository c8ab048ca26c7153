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

// Which face each texel belongs to, a row a line; a dot for none.
std::string FacesOf(int size_px, const MeshTexture& texture, const std::vector<Face>& faces) {
  const auto texels = RasterizeTexture(size_px, faces, texture, "--texture");
  EXPECT_TRUE(texels.ok()) << texels.status();
  std::string map;
  for (size_t t = 0; t < texels->size(); ++t) {
    map += (*texels)[t].face < 0 ? "." : std::to_string((*texels)[t].face);
    if ((t + 1) % static_cast<size_t>(size_px) == 0) map += "\n";
  }
  return map;
}

TEST(TextureRaster, FacesCoverTheTexelsWhoseMiddleTheyHold) {
  MeshTexture texture;
  texture.of_vertex = {{0.25F, 0.25F}, {0.75F, 0.25F}, {0.75F, 1}, {-0.5F, 0.5F}};
  const std::vector<Face> faces = {{0, 1, 2}, {0, 2, 3}, {0, 0, 1}};
  EXPECT_EQ(FacesOf(8, texture, faces), R"(.....1..
..1110..
111100..
111100..
111000..
110000..
........
........
)");
  texture.of_corner = {{Eigen::Vector2f(0, 0), {1, 0}, {1, 1}},
                       {Eigen::Vector2f(0, 0), {0, 0}, {0, 0}},
                       {Eigen::Vector2f(0, 0), {0, 0}, {0, 0}}};
  EXPECT_EQ(FacesOf(4, texture, faces), "...0\n..00\n.000\n0000\n") << "corners of their own";
}

TEST(TextureRaster, TheGutterIsTheMeanOfTheTexelsAround) {
  std::vector<Eigen::Vector4f> values(9, Eigen::Vector4f::Zero());
  values[0] = {2, 0, 0, 1}, values[2] = {0, 4, 0, 1}, values[8] = {0, 0, 3, 2};
  AddGutter(3, values);
  EXPECT_EQ(values[1], Eigen::Vector4f(1, 2, 0, 1));
  EXPECT_EQ(values[5], Eigen::Vector4f(0, 4.0F / 3, 1, 1)) << "by their weights";
  EXPECT_EQ(values[8], Eigen::Vector4f(0, 0, 3, 2)) << "what is known stays";
}

}  // namespace
}  // namespace weft
