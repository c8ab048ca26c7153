#include "alignment/mesh_texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace weft {
namespace {

constexpr int kTextureRows = 5, kTextureCols = 16;

// A sheet of cells, `kCols` around and kRows along; `rings` adds vertices without a cell beside the last
// column. Closed: a tube whose last column is sewn to the first.
Template Cloth(bool closed, int seam_cols) {
  Template garment;
  const int around = kTextureCols + seam_cols;
  const double radius = around / (2 * M_PI);
  for (int row = 0; row < kTextureRows; ++row) {
    for (int col = 0; col < around; ++col) {
      const double angle = 2 * M_PI * col / around;
      garment.rest.vertices_mm.push_back(
          closed ? Eigen::Vector3d(radius * std::cos(angle), row, radius * std::sin(angle))
                 : Eigen::Vector3d(col, row, 0));
      garment.node_of_vertex.push_back(col < kTextureCols ? VertexNode{row, col} : VertexNode{});
    }
  }
  for (int row = 0; row + 1 < kTextureRows; ++row) {
    for (int col = 0; col < around - (closed ? 0 : 1); ++col) {
      const int next = (col + 1) % around;
      const int a = row * around + col, b = row * around + next, c = a + around, d = b + around;
      garment.rest.faces.push_back({a, c, b});
      garment.rest.faces.push_back({b, c, d});
    }
  }
  return garment;
}

double LongestEdge(const std::array<Eigen::Vector2f, 3>& corners) {
  double longest = 0;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2f edge = corners[(k + 1) % 3] - corners[k];
    longest = std::max(longest, static_cast<double>(std::hypot(edge.x() * 24, edge.y() * kTextureRows)));
  }
  return longest;
}

// The board is wider than the garment, so that there is room beside the last column.
MeshTexture TextureOn24Columns(const Template& garment) {
  std::vector<Eigen::Vector2d> places;
  for (const VertexNode& node : garment.node_of_vertex) {
    places.emplace_back(node.col + 4.5, kTextureRows - node.row - 0.5);
  }
  return SpreadTexture(garment, places, {24, kTextureRows});
}

TEST(MeshTexture, CellsLieWhereTheBoardHasThem) {
  const Template sheet = Cloth(false, 0);
  const MeshTexture texture = BoardTexture(sheet, kTextureRows, kTextureCols);
  EXPECT_TRUE(texture.of_corner.empty());
  ASSERT_EQ(texture.of_vertex.size(), sheet.node_of_vertex.size());
  for (size_t v = 0; v < texture.of_vertex.size(); ++v) {
    const VertexNode& node = sheet.node_of_vertex[v];
    EXPECT_FLOAT_EQ(texture.of_vertex[v].x(), (node.col + 0.5f) / kTextureCols);
    EXPECT_FLOAT_EQ(texture.of_vertex[v].y(), 1 - (node.row + 0.5f) / kTextureRows);
  }
}

TEST(MeshTexture, PrintGoesOnBesideThePanel) {
  const MeshTexture texture = TextureOn24Columns(Cloth(false, 2));
  EXPECT_TRUE(texture.of_corner.empty());
  for (int row = 0; row < kTextureRows; ++row) {
    for (int col = kTextureCols; col < kTextureCols + 2; ++col) {
      const Eigen::Vector2f& place = texture.of_vertex[row * (kTextureCols + 2) + col];
      EXPECT_NEAR(place.x() * 24, col + 4.5, 1e-4);
      EXPECT_NEAR((1 - place.y()) * kTextureRows, row + 0.5,
                  0.3);  // the mean over the neighbours that are placed
    }
  }
}

// `around`: vertices of a ring. No face of the tube smears the print, and those off the seam keep their
// vertices'.
void ExpectNoFaceSmears(const Template& tube, int around) {
  const MeshTexture texture = TextureOn24Columns(tube);
  ASSERT_EQ(texture.of_corner.size(), tube.rest.faces.size());
  int other = 0;
  for (size_t f = 0; f < tube.rest.faces.size(); ++f) {
    EXPECT_LT(LongestEdge(texture.of_corner[f]), 2.2) << "face " << f;
    for (int k = 0; k < 3; ++k) {
      const int v = tube.rest.faces[f][k], col = v % around;
      const bool same = texture.of_corner[f][k] == texture.of_vertex[v];
      if (col > 0 && col < kTextureCols - 1) {
        EXPECT_TRUE(same) << "face " << f;
      }
      other += !same;
    }
  }
  EXPECT_GT(other, 0);
}

TEST(MeshTexture, FacesAcrossASeamHaveTheirOwnPlaces) {
  ExpectNoFaceSmears(Cloth(true, 0), kTextureCols);
  ExpectNoFaceSmears(Cloth(true, 1), kTextureCols + 1);
  ExpectNoFaceSmears(Cloth(true, 3), kTextureCols + 3);
}

TEST(MeshTexture, IsInsideItsSquareAndTheSameEveryTime) {
  const Template tube = Cloth(true, 3);
  const MeshTexture texture = BoardTexture(tube, kTextureRows, kTextureCols),
                    again = BoardTexture(tube, kTextureRows, kTextureCols);
  for (const auto& corners : texture.of_corner) {
    for (const Eigen::Vector2f& place : corners) {
      EXPECT_GE(place.minCoeff(), 0);
      EXPECT_LE(place.maxCoeff(), 1);
    }
  }
  EXPECT_EQ(texture.of_corner, again.of_corner);
  EXPECT_EQ(texture.of_vertex, again.of_vertex);
}

TEST(MeshTexture, PanelsThatArePackedComeBeforeTheBoard) {
  const Template sheet = Cloth(false, 0);
  GarmentParts parts;
  EXPECT_TRUE(TextureOf(sheet, parts).empty());
  parts.board_rows = kTextureRows, parts.board_cols = kTextureCols;
  EXPECT_EQ(TextureOf(sheet, parts).of_vertex, BoardTexture(sheet, kTextureRows, kTextureCols).of_vertex);
  parts.texture_side_mm = 20;
  for (const Eigen::Vector3d& p : sheet.rest.vertices_mm) parts.texture_mm.emplace_back(p.y(), p.x());
  EXPECT_EQ(TextureOf(sheet, parts).of_vertex[1], Eigen::Vector2f(0, 0.05f));
}

}  // namespace
}  // namespace weft
