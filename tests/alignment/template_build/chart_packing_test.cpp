#include "alignment/template_build/chart_packing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "alignment/template_build/template_checks.h"

namespace weft {
namespace {

constexpr double kCellMm = 2.5;

// Letters are panels, a character per cell.
PanelSheet PanelSheetOf(const std::vector<std::string>& board) {
  BoardPanels panels{static_cast<int>(board.size()), static_cast<int>(board[0].size()), 0, {}};
  for (const std::string& row : board) {
    for (const char c : row) panels.panel_of_cell.push_back(c == '.' ? -1 : c - 'a');
  }
  absl::StatusOr<PanelSheet> sheet = MakePanelSheet(panels, kCellMm, 4);
  EXPECT_TRUE(sheet.ok()) << sheet.status();
  return *std::move(sheet);
}

GarmentParts Pack(const PanelSheet& sheet, int gap_cells) {
  GarmentParts parts;
  parts.cell_mm = kCellMm;
  parts.panels = DescribePanels(sheet);
  PackCharts(sheet, kCellMm, gap_cells, &parts);
  return parts;
}

// Places in cells from the upper left corner.
std::pair<int, int> CellAt(const GarmentParts& parts, size_t vertex) {
  const double col = parts.texture_mm[vertex].x() / kCellMm - 0.5;
  const double row = (parts.texture_side_mm - parts.texture_mm[vertex].y()) / kCellMm - 0.5;
  EXPECT_NEAR(col, std::round(col), 1e-9);
  EXPECT_NEAR(row, std::round(row), 1e-9);
  return {static_cast<int>(std::lround(row)), static_cast<int>(std::lround(col))};
}

const std::vector<std::string> kTriangles = {
    "aaaaaaaaaa..bbbbb", "aaaaaaaaa...bbbbb", "aaaaaaaa....bbbbb", "aaaaaaa.....bbbbb", "aaaaaa......bbbbb",
    "aaaaa............", "aaaa..cccccccccc.", "aaa...cccccccccc.", "aa...............", "aa..............."};

TEST(PackCharts, KeepsEveryDistanceOfThePrintAndItsHandedness) {
  const PanelSheet sheet = PanelSheetOf(kTriangles);
  const GarmentParts parts = Pack(sheet, 2);
  ASSERT_EQ(parts.texture_mm.size(), sheet.cell_of_vertex.size());
  for (const auto& [a, b, c] : sheet.flat.faces) {
    const auto turn = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
      return u.x() * v.y() - u.y() * v.x();
    };
    const std::vector<Eigen::Vector3d>& flat = sheet.flat.vertices_mm;
    const Eigen::Vector2d ab = parts.texture_mm[b] - parts.texture_mm[a];
    const Eigen::Vector2d ac = parts.texture_mm[c] - parts.texture_mm[a];
    EXPECT_NEAR(ab.norm(), (flat[b] - flat[a]).norm(), 1e-9);
    EXPECT_NEAR(ac.norm(), (flat[c] - flat[a]).norm(), 1e-9);
    EXPECT_GT(turn(ab, ac), 0);  // counter-clockwise seen from the printed side, t upwards
  }
}

TEST(PackCharts, KeepsChartsApartAndInsideTheSquare) {
  const PanelSheet sheet = PanelSheetOf(kTriangles);
  for (const int gap : {0, 1, 4}) {
    const GarmentParts parts = Pack(sheet, gap);
    const int side = static_cast<int>(std::lround(parts.texture_side_mm / kCellMm)), margin = (gap + 1) / 2;
    std::set<std::pair<int, int>> taken;
    for (size_t v = 0; v < sheet.cell_of_vertex.size(); ++v) {
      const auto [row, col] = CellAt(parts, v);
      EXPECT_GE(std::min(row, col), margin);
      EXPECT_LT(std::max(row, col), side - margin);
      EXPECT_TRUE(taken.emplace(row, col).second);
      for (size_t w = 0; w < v; ++w) {
        if (sheet.panel_of_vertex[w] == sheet.panel_of_vertex[v]) continue;
        const auto [other_row, other_col] = CellAt(parts, w);
        EXPECT_GT(std::max(std::abs(row - other_row), std::abs(col - other_col)), gap);
      }
    }
  }
}

TEST(PackCharts, PlacesOfPanelsTellWhereTheirCellsLie) {
  const PanelSheet sheet = PanelSheetOf(kTriangles);
  const GarmentParts parts = Pack(sheet, 2);
  bool turned = false;
  for (size_t v = 0; v < sheet.cell_of_vertex.size(); ++v) {
    const TemplatePanel& panel = parts.panels[sheet.panel_of_vertex[v]];
    turned = turned || panel.quarter_turns % 2 == 1;
    int row = sheet.cell_of_vertex[v].row - panel.first_row, rows = panel.last_row - panel.first_row + 1;
    int col = sheet.cell_of_vertex[v].col - panel.first_col, cols = panel.last_col - panel.first_col + 1;
    for (int turn = 0; turn < panel.quarter_turns; ++turn) {
      const int next_row = col;
      col = rows - 1 - row, row = next_row;
      std::swap(rows, cols);
    }
    EXPECT_EQ(CellAt(parts, v), std::pair(panel.texture_row + row, panel.texture_col + col));
  }
  EXPECT_TRUE(turned);
}

TEST(PackCharts, LaysChartsIntoEachOther) {
  // Two triangles, each half of a square of twelve cells; side by side they would need one of 24.
  std::vector<std::string> board;
  for (int i = 0; i < 12; ++i) {
    board.push_back(std::string(12 - i, 'a') + std::string(i + 3, '.') + std::string(12 - i, 'b') +
                    std::string(i, '.'));
  }
  const GarmentParts parts = Pack(PanelSheetOf(board), 1);
  EXPECT_LE(parts.texture_side_mm, 17 * kCellMm);
}

}  // namespace
}  // namespace weft
