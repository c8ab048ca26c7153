#include "services/results/export/split_vertices.h"

#include <gmock/gmock.h>

namespace weft {
namespace {

using ::testing::ElementsAre;

const std::vector<Face> kTwoFaces = {{0, 1, 2}, {0, 2, 3}};

TEST(SplitAtSeams, KeepsAMeshWithoutSeams) {
  MeshTexture texture;
  texture.of_vertex.assign(4, Eigen::Vector2f::Zero());
  const SplitMesh split = SplitAtSeams(4, kTwoFaces, texture);
  EXPECT_THAT(split.origin, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(split.faces, kTwoFaces);
  EXPECT_EQ(split.uv.size(), 4u);
  EXPECT_TRUE(SplitAtSeams(4, kTwoFaces, {}).uv.empty());
}

TEST(SplitAtSeams, CopiesAVertexOncePerPlaceOnThePrint) {
  MeshTexture texture;
  for (int v = 0; v < 4; ++v) texture.of_vertex.emplace_back(v, 0);
  texture.of_corner = {{texture.of_vertex[0], texture.of_vertex[1], texture.of_vertex[2]},
                       {Eigen::Vector2f(9, 9), Eigen::Vector2f(8, 8), texture.of_vertex[3]}};
  std::vector<Face> faces = kTwoFaces;
  faces.push_back({2, 0, 3});
  texture.of_corner.push_back({Eigen::Vector2f(8, 8), Eigen::Vector2f(9, 9), texture.of_vertex[3]});
  const SplitMesh split = SplitAtSeams(4, faces, texture);
  EXPECT_THAT(split.origin, ElementsAre(0, 1, 2, 3, 0, 2));
  EXPECT_THAT(split.faces, ElementsAre(Face{0, 1, 2}, Face{4, 5, 3}, Face{5, 4, 3}));
  for (size_t f = 0; f < faces.size(); ++f)
    for (int k = 0; k < 3; ++k) EXPECT_EQ(split.uv[split.faces[f][k]], texture.of_corner[f][k]);
}

TEST(SplitAtSeams, LeavesNoVertexWithoutAFace) {
  MeshTexture texture;
  texture.of_vertex.assign(4, Eigen::Vector2f(5, 5));
  texture.of_corner.resize(2);
  for (auto& corners : texture.of_corner) corners = {Eigen::Vector2f(1, 0), {2, 0}, {3, 0}};
  const SplitMesh split = SplitAtSeams(4, kTwoFaces, texture);
  EXPECT_THAT(split.origin, ElementsAre(0, 1, 2, 3, 2));
  EXPECT_THAT(split.faces, ElementsAre(Face{0, 1, 2}, Face{0, 4, 3}));
  EXPECT_EQ(split.uv[3], Eigen::Vector2f(3, 0));
  EXPECT_EQ(split.uv[4], Eigen::Vector2f(2, 0));
}

}  // namespace
}  // namespace weft
