#include "animation/atlas/atlas.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/animation/atlas/recorded_atlas.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

using testing::HasSubstr;

// Two flat panels of rows x columns cells beside each other, printed at different places of the board, with a
// row of vertices without a cell sewn between them: the cloth goes on along x from the first to the second.
class SewnSheets {
 public:
  static constexpr int kRows = 12, kColumns = 10, kAcross = 2 * kColumns + 1;
  static constexpr double kCellMm = 10;

  static Template Garment() {
    Template out;
    out.id = "sheets";
    for (int row = 0; row < kRows; ++row)
      for (int x = 0; x < kAcross; ++x) {
        out.rest.vertices_mm.emplace_back(x * kCellMm, row * kCellMm, 0);
        VertexNode node;
        if (x < kColumns) node = {row + 3, x + 5, NodeKind::kCenter};
        if (x > kColumns) node = {row + 40, x + 60, NodeKind::kCenter};
        out.node_of_vertex.push_back(node);
        if (row + 1 == kRows || x + 1 == kAcross) continue;
        const int a = row * kAcross + x;
        out.rest.faces.push_back({a, a + 1, a + kAcross});
        out.rest.faces.push_back({a + 1, a + kAcross + 1, a + kAcross});
      }
    return out;
  }
};

absl::StatusOr<Atlas> BoardAtlas(const Template& garment, const AtlasOptions& options) {
  return Atlas::Build(garment, ChartsOnBoard(garment), options);
}

std::vector<float> SmoothField(const Template& garment) {
  std::vector<float> out;
  for (const Eigen::Vector3d& p : garment.rest.vertices_mm) {
    out.push_back(static_cast<float>(5 * std::sin(0.003 * p.x() + 0.006 * p.y())));
    out.push_back(static_cast<float>(0.01 * p.x() - 0.02 * p.y()));
  }
  return out;
}

double LargestDifference(const Template& garment, const std::vector<float>& a, const std::vector<float>& b,
                         bool cells) {
  double out = 0;
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v)
    if ((garment.node_of_vertex[v].row >= 0) == cells)
      for (size_t c = 0; c < 2; ++c)
        out = std::max(out, std::abs(static_cast<double>(a[2 * v + c]) - b[2 * v + c]));
  return out;
}

TEST(Atlas, CellsComeBackExactlyAndSeamsNearly) {
  for (const Template& garment : {SewnSheets::Garment(), WavingTube::Garment()}) {
    const auto atlas = BoardAtlas(garment, {.level = 0, .gutter = 3, .multiple = 8});
    ASSERT_TRUE(atlas.ok()) << atlas.status();
    const std::vector<float> field = SmoothField(garment);
    const std::vector<float> back = atlas->Scatter(atlas->Gather(field, 2));
    EXPECT_EQ(LargestDifference(garment, field, back, true), 0);
    // In mm where the field is of offsets.
    EXPECT_LT(LargestDifference(garment, field, back, false), 0.05);
  }
}

TEST(Atlas, TexelsOfFourCellsKeepWhatIsSmooth) {
  const Template garment = SewnSheets::Garment();
  const auto atlas = BoardAtlas(garment, {.level = 1, .gutter = 3, .multiple = 8});
  ASSERT_TRUE(atlas.ok()) << atlas.status();
  EXPECT_EQ(atlas->width() % 8, 0);
  EXPECT_EQ(atlas->height() % 8, 0);
  const std::vector<float> field = SmoothField(garment);
  const std::vector<float> back = atlas->Scatter(atlas->Gather(field, 2));
  // The field changes by up to .03 per mm. Open borders lie a quarter of a texel of 20 mm beyond its middle,
  // both ways at corners.
  EXPECT_LT(LargestDifference(garment, field, back, true), 0.3);
  // Within the sheets, and beside their seam, interpolation is linear.
  double inside = 0;
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v) {
    const Eigen::Vector3d& p = garment.rest.vertices_mm[v];
    if (p.x() < 25 || p.x() > 175 || p.y() < 25 || p.y() > 85) continue;
    for (size_t c = 0; c < 2; ++c)
      inside = std::max(inside, std::abs(static_cast<double>(field[2 * v + c]) - back[2 * v + c]));
  }
  EXPECT_LT(inside, 0.05);
}

TEST(Atlas, PanelsLieApart) {
  const auto two = BoardAtlas(SewnSheets::Garment(), {.level = 0, .gutter = 2, .multiple = 4});
  ASSERT_TRUE(two.ok());
  EXPECT_EQ(two->panels(), 2);
  int panel_texels = 0;
  for (const TexelKind kind : two->kinds()) panel_texels += kind == TexelKind::kPanel ? 1 : 0;
  EXPECT_EQ(panel_texels, 2 * SewnSheets::kRows * SewnSheets::kColumns);
  EXPECT_EQ(BoardAtlas(WavingTube::Garment(), {})->panels(), 1);
}

// The cloth along x at each texel of the image of the sheets, as the gutter shows it.
TEST(Atlas, GutterShowsTheClothBeyondTheSeam) {
  const Template garment = SewnSheets::Garment();
  const auto atlas = BoardAtlas(garment, {.level = 0, .gutter = 3, .multiple = 4});
  ASSERT_TRUE(atlas.ok());
  std::vector<float> along, row;
  for (const Eigen::Vector3d& p : garment.rest.vertices_mm)
    along.push_back(static_cast<float>(p.x() / SewnSheets::kCellMm)),
        row.push_back(static_cast<float>(p.y() / SewnSheets::kCellMm));
  const AtlasImage x = atlas->Gather(along, 1), y = atlas->Gather(row, 1);
  int checked = 0;
  const auto at = [&](int r, int c) { return static_cast<size_t>(r) * atlas->width() + c; };
  for (int r = 4; r + 4 < atlas->height(); ++r)
    for (int c = 4; c + 4 < atlas->width(); ++c) {
      if (atlas->kinds()[at(r, c)] != TexelKind::kSeam) continue;
      for (const auto& [dr, dc] : {std::pair(0, 1), {0, -1}, {1, 0}, {-1, 0}}) {
        const size_t beside = at(r + dr, c + dc), next = at(r + 2 * dr, c + 2 * dc);
        // The first texel beyond a seam, well away from the panel's corners.
        if (atlas->kinds()[beside] != TexelKind::kPanel || atlas->kinds()[next] != TexelKind::kPanel)
          continue;
        const float rows = y.values[beside];
        if (rows < 4 || rows > SewnSheets::kRows - 5) continue;
        // Between the two lies the row of vertices without cells.
        const float step = x.values[beside] - x.values[next];
        EXPECT_NEAR(x.values[at(r, c)], x.values[beside] + 2 * step, 1e-4);
        EXPECT_NEAR(y.values[at(r, c)], rows, 1e-4);
        ++checked;
      }
    }
  EXPECT_GE(checked, 6);
}

TEST(Atlas, OpenBordersAreRepeated) {
  const Template garment = SewnSheets::Garment();
  const auto atlas = BoardAtlas(garment, {.level = 0, .gutter = 2, .multiple = 4});
  const AtlasImage image = atlas->Gather(SmoothField(garment), 2);
  std::set<float> of_panels;
  for (size_t t = 0; t < image.PlaneSize(); ++t)
    if (atlas->kinds()[t] == TexelKind::kPanel) of_panels.insert(image.values[t]);
  int borders = 0;
  for (size_t t = 0; t < image.PlaneSize(); ++t) {
    if (atlas->kinds()[t] == TexelKind::kEmpty) {
      EXPECT_EQ(image.values[t], 0);
    }
    if (atlas->kinds()[t] != TexelKind::kBorder) continue;
    EXPECT_TRUE(of_panels.contains(image.values[t]));
    ++borders;
  }
  EXPECT_GT(borders, 2 * SewnSheets::kColumns);
}

TEST(Atlas, RefusesOptionsThatMakeNoSense) {
  EXPECT_THAT(std::string(BoardAtlas(WavingTube::Garment(), {.level = 7}).status().message()),
              HasSubstr("level"));
  EXPECT_THAT(std::string(BoardAtlas(WavingTube::Garment(), {.gutter = -1}).status().message()),
              HasSubstr("gutter"));
  EXPECT_THAT(std::string(BoardAtlas(WavingTube::Garment(), {.multiple = 0}).status().message()),
              HasSubstr("multiple"));
}

// Images of all levels, with their seams and borders, and what vertices take from them.
TEST(Atlas, ImagesStayAsTheyAre) {
  Recorded recorded;
  for (const Template& garment : {SewnSheets::Garment(), WavingTube::Garment()})
    for (const int level : {0, 1, 2}) {
      const auto atlas = BoardAtlas(garment, {.level = level, .gutter = 3, .multiple = 4});
      ASSERT_TRUE(atlas.ok()) << atlas.status();
      AddAtlas(garment.id + " " + std::to_string(level), *atlas, atlas->Gather(SmoothField(garment), 2),
               recorded);
    }
  recorded.Expect();
}

}  // namespace
}  // namespace weft
