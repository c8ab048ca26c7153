#include "animation/atlas/cloth_charts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "animation/atlas/atlas.h"
#include "tests/animation/atlas/recorded_atlas.h"
#include "tests/animation/recorded.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr int kTubeAround = 24, kTubeRows = 16;
constexpr double kTubeEdgeMm = 10;

// A tube of squares that is cut open along one line, as an unwrapped cylinder; its texture is squeezed along
// v.
GarmentMesh UnwrappedTube() {
  GarmentMesh out;
  const double radius = kTubeEdgeMm / (2 * std::sin(M_PI / kTubeAround));
  const auto place = [](int c, int r) {
    return Eigen::Vector2f(static_cast<float>(c) / kTubeAround, 0.3f * static_cast<float>(r) / kTubeRows);
  };
  for (int r = 0; r <= kTubeRows; ++r)
    for (int c = 0; c < kTubeAround; ++c) {
      const double angle = 2 * M_PI * c / kTubeAround;
      out.rest.vertices_mm.emplace_back(radius * std::cos(angle), kTubeEdgeMm * r, radius * std::sin(angle));
      out.texture.of_vertex.push_back(place(c, r));
    }
  for (int r = 0; r < kTubeRows; ++r)
    for (int c = 0; c < kTubeAround; ++c) {
      const int next = (c + 1) % kTubeAround, row = r * kTubeAround, above = row + kTubeAround;
      out.rest.faces.push_back({row + c, row + next, above + next});
      out.texture.of_corner.push_back({place(c, r), place(c + 1, r), place(c + 1, r + 1)});
      out.rest.faces.push_back({row + c, above + next, above + c});
      out.texture.of_corner.push_back({place(c, r), place(c + 1, r + 1), place(c, r + 1)});
    }
  return out;
}

// Two squares of cloth that share an edge, each a chart of its own and both anywhere in the texture.
GarmentMesh TwoCharts() {
  GarmentMesh out;
  constexpr int kSide = 12;
  for (int y = 0; y <= kSide; ++y)
    for (int x = 0; x <= 2 * kSide; ++x) {
      out.rest.vertices_mm.emplace_back(5 * x, 5 * y, 0);
      out.texture.of_vertex.emplace_back(0, 0);
    }
  const auto place = [](int x, int y, bool second) {
    // Mirrored, of half the size, and over the first: as sleeves are often laid.
    return second
               ? Eigen::Vector2f(0.4f - 0.01f * static_cast<float>(x - kSide),
                                 0.1f + 0.01f * static_cast<float>(y))
               : Eigen::Vector2f(0.1f + 0.02f * static_cast<float>(x), 0.1f + 0.02f * static_cast<float>(y));
  };
  const auto add = [&](const std::array<std::pair<int, int>, 3>& corners, bool second) {
    Face face{};
    std::array<Eigen::Vector2f, 3> uv;
    for (size_t k = 0; k < 3; ++k) {
      const auto [x, y] = corners[k];
      face[k] = y * (2 * kSide + 1) + x;
      uv[k] = place(x, y, second);
    }
    out.rest.faces.push_back(face);
    out.texture.of_corner.push_back(uv);
  };
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < 2 * kSide; ++x) {
      add({{{x, y}, {x + 1, y}, {x + 1, y + 1}}}, x >= kSide);
      add({{{x, y}, {x + 1, y + 1}, {x, y + 1}}}, x >= kSide);
    }
  return out;
}

// A number that is linear along the cloth of both squares.
std::vector<float> FieldAlong(const GarmentMesh& garment) {
  std::vector<float> out;
  for (const Eigen::Vector3d& p : garment.rest.vertices_mm)
    out.push_back(static_cast<float>(0.02 * p.x() - 0.03 * p.y()));
  return out;
}

std::string WhyNot(const GarmentMesh& garment) {
  const auto charts = ChartsOfTexture(garment);
  EXPECT_EQ(charts.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(charts.status().message());
}

TEST(ChartsOfTexture, ATubeCutOpenIsOneChartOfTheClothsSize) {
  const auto charts = ChartsOfTexture(UnwrappedTube());
  ASSERT_TRUE(charts.ok()) << charts.status();
  EXPECT_EQ(charts->charts, 1);
  EXPECT_EQ(charts->seam_edges, kTubeRows);
  EXPECT_NEAR(charts->seam_mm, kTubeRows * kTubeEdgeMm, 1e-6);
  EXPECT_NEAR(charts->cell_mm, kTubeEdgeMm, 1e-6);
  // Whatever the texture's aspect, edges are a cell long along both axes.
  const auto& first = charts->corner_cells[0];
  EXPECT_NEAR(std::abs(first[1].x() - first[0].x()), 1, 1e-3);
  EXPECT_NEAR(std::abs(first[2].y() - first[1].y()), 1, 1e-3);
}

TEST(ChartsOfTexture, FacesThatDisagreeAtAnEdgeAreOfTwoCharts) {
  const auto charts = ChartsOfTexture(TwoCharts());
  ASSERT_TRUE(charts.ok()) << charts.status();
  EXPECT_EQ(charts->charts, 2);
  EXPECT_EQ(charts->seam_edges, 12);
  const std::set<int> of_faces(charts->of_face.begin(), charts->of_face.end());
  EXPECT_EQ(of_faces, (std::set<int>{0, 1}));
  // Both are scaled to the same cloth.
  const auto& second = charts->corner_cells[2 * 13];
  EXPECT_NEAR((second[1] - second[0]).norm(), 1, 1e-3);
}

TEST(ChartsOfTexture, SaysWhatIsMissing) {
  GarmentMesh garment = TwoCharts();
  garment.texture = {};
  EXPECT_THAT(WhyNot(garment), HasSubstr("no texture coordinates; unwrap it"));
  garment = TwoCharts();
  for (auto& corners : garment.texture.of_corner) corners.fill({0.5f, 0.5f});
  EXPECT_THAT(WhyNot(garment), HasSubstr("face 0: its chart has no area in the texture; unwrap"));
}

TEST(ChartsOfTexture, RefusesAChartThatIsStretchedBeyondUse) {
  GarmentMesh garment = UnwrappedTube();
  for (auto& corners : garment.texture.of_corner)
    for (Eigen::Vector2f& uv : corners)
      if (uv.x() == 1) uv.x() = 1e4f;
  EXPECT_THAT(WhyNot(garment), HasSubstr("parts of it are stretched; unwrap"));
}

TEST(AtlasOfTexture, GivesBackWhatItGathered) {
  for (const GarmentMesh& garment : {UnwrappedTube(), TwoCharts()}) {
    const auto charts = ChartsOfTexture(garment);
    ASSERT_TRUE(charts.ok()) << charts.status();
    const auto atlas = Atlas::Build(garment, *charts, {.level = 0, .gutter = 2, .multiple = 4});
    ASSERT_TRUE(atlas.ok()) << atlas.status();
    EXPECT_EQ(atlas->panels(), charts->charts);
    std::vector<float> field = FieldAlong(garment);
    const std::vector<float> back = atlas->Scatter(atlas->Gather(field, 1));
    double worst = 0;
    for (size_t v = 0; v < field.size(); ++v)
      worst = std::max(worst, std::abs(static_cast<double>(back[v]) - field[v]));
    // The field changes by 0.3 along an edge of 10 mm.
    EXPECT_LT(worst, 0.05);
  }
}

// No texel inside a chart is empty, though the mesh has a vertex in every second cell at most.
TEST(AtlasOfTexture, TexelsBetweenVerticesAreFilled) {
  const GarmentMesh garment = TwoCharts();
  auto charts = ChartsOfTexture(garment);
  ASSERT_TRUE(charts.ok());
  for (auto& corners : charts->corner_cells)
    for (Eigen::Vector2d& cells : corners) cells *= 3;
  for (Eigen::Vector2d& cells : charts->vertex_cells) cells *= 3;
  const auto atlas = Atlas::Build(garment, *charts, {.level = 0, .gutter = 2, .multiple = 4});
  ASSERT_TRUE(atlas.ok());
  int panel_texels = 0;
  for (const TexelKind kind : atlas->kinds()) panel_texels += kind == TexelKind::kPanel ? 1 : 0;
  // 37 x 37 cells each, of which the outermost are those of the border.
  EXPECT_GE(panel_texels, 2 * 36 * 36);
  EXPECT_LE(panel_texels, 2 * 38 * 38);
  const std::vector<float> field = FieldAlong(garment);
  const AtlasImage image = atlas->Gather(field, 1);
  const auto [low, high] = std::minmax_element(field.begin(), field.end());
  for (size_t t = 0; t < image.PlaneSize(); ++t) {
    if (atlas->kinds()[t] != TexelKind::kPanel) continue;
    EXPECT_GE(image.values[t], *low - 1e-5f);
    EXPECT_LE(image.values[t], *high + 1e-5f);
  }
}

TEST(AtlasOfTexture, BothSidesOfASeamShowTheOther) {
  const GarmentMesh garment = TwoCharts();
  const auto charts = ChartsOfTexture(garment);
  const auto atlas = Atlas::Build(garment, *charts, {.level = 0, .gutter = 2, .multiple = 4});
  ASSERT_TRUE(atlas.ok());
  std::vector<float> side;  // -1 in the first square, 1 in the second, 0 on the seam
  for (const Eigen::Vector3d& p : garment.rest.vertices_mm)
    side.push_back(p.x() < 59 ? -1.0f : p.x() > 61 ? 1.0f : 0.0f);
  const AtlasImage image = atlas->Gather(side, 1);
  int of_first = 0, of_second = 0;
  for (size_t t = 0; t < image.PlaneSize(); ++t) {
    if (atlas->kinds()[t] != TexelKind::kSeam) continue;
    of_first += image.values[t] < 0 ? 1 : 0, of_second += image.values[t] > 0 ? 1 : 0;
  }
  EXPECT_GT(of_first, 10);
  EXPECT_GT(of_second, 10);
}

TEST(AtlasOfTexture, ImagesStayAsTheyAre) {
  Recorded recorded;
  for (const auto& [name, garment] : {std::pair<std::string, GarmentMesh>("tube", UnwrappedTube()),
                                      std::pair<std::string, GarmentMesh>("two", TwoCharts())}) {
    auto charts = ChartsOfTexture(garment);
    ASSERT_TRUE(charts.ok()) << charts.status();
    for (const double cells : {1.0, 2.5}) {
      for (auto& corners : charts->corner_cells)
        for (Eigen::Vector2d& corner : corners) corner *= cells;
      for (Eigen::Vector2d& vertex : charts->vertex_cells) vertex *= cells;
      const auto atlas = Atlas::Build(garment, *charts, {.level = 0, .gutter = 2, .multiple = 4});
      ASSERT_TRUE(atlas.ok()) << atlas.status();
      AddAtlas(name + " x " + std::to_string(cells).substr(0, 3), *atlas,
               atlas->Gather(FieldAlong(garment), 1), recorded);
    }
  }
  recorded.Expect();
}

TEST(ChartsOfTexture, VerticesLieWhereTheirFirstFaceHasThem) {
  const auto charts = ChartsOfTexture(TwoCharts());
  ASSERT_TRUE(charts.ok()) << charts.status();
  EXPECT_EQ(charts->seam_mm, 12 * 5);
  for (size_t v = 0; v < charts->of_vertex.size(); ++v) EXPECT_EQ(charts->of_vertex[v], v % 25 > 12 ? 1 : 0);
  // The first chart lies upside down in the image, and begins with the middle of a cell.
  EXPECT_LT((charts->vertex_cells[0] - Eigen::Vector2d(0.5, 12.5)).norm(), 1e-3);
  EXPECT_LT((charts->vertex_cells[12 * 25 + 12] - Eigen::Vector2d(12.5, 0.5)).norm(), 1e-3);
  // The second is mirrored as well.
  EXPECT_LT((charts->vertex_cells[24] - Eigen::Vector2d(0.5, 12.5)).norm(), 1e-3);
}

TEST(ChartsOfTexture, RefusesEdgesWithoutLength) {
  GarmentMesh garment = TwoCharts();
  for (Eigen::Vector3d& p : garment.rest.vertices_mm) p.setZero();
  EXPECT_EQ(WhyNot(garment), "most edges of the mesh have no length; merge vertices by distance");
}

// Cells of one panel are joined from neighbour to neighbour, also across a diagonal.
TEST(ChartsOnBoard, PanelsEndWhereTheBoardDoesNotGoOn) {
  Template garment;
  for (int v = 0; v < 6; ++v) garment.rest.vertices_mm.emplace_back(10 * v, v % 2, 0);
  garment.rest.faces = {{0, 1, 2}, {1, 2, 3}, {2, 3, 4}, {3, 4, 5}};
  garment.node_of_vertex = {{3, 3, NodeKind::kCenter}, {4, 4, NodeKind::kCenter},
                            {4, 3, NodeKind::kCenter}, {},
                            {9, 9, NodeKind::kCenter}, {9, 11, NodeKind::kCenter}};
  const ClothCharts charts = ChartsOnBoard(garment);
  EXPECT_EQ(charts.charts, 3);
  EXPECT_EQ(charts.of_vertex, (std::vector<int>{0, 0, 0, -1, 1, 2}));
  EXPECT_EQ(charts.vertex_cells[0], garment.node_of_vertex[0].PlaceInCells());
}

}  // namespace
}  // namespace weft
