#include "alignment/template_build/chart_packing.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace weft {
namespace {

// A panel after quarter turns: its box, and the first and last of its rows in each column.
struct Chart {
  int rows = 0, cols = 0;
  std::vector<int> top, bottom;  // [cols]
};

// Row and column within the box of a panel that was turned clockwise.
std::pair<int, int> Turned(int row, int col, int rows, int cols, int quarter_turns) {
  switch (quarter_turns) {
    case 1:
      return {col, rows - 1 - row};
    case 2:
      return {rows - 1 - row, cols - 1 - col};
    case 3:
      return {cols - 1 - col, row};
    default:
      return {row, col};
  }
}

std::pair<int, int> PlaceInBox(const TemplatePanel& panel, const VertexNode& cell, int quarter_turns) {
  return Turned(cell.row - panel.first_row, cell.col - panel.first_col, panel.last_row - panel.first_row + 1,
                panel.last_col - panel.first_col + 1, quarter_turns);
}

std::vector<Chart> ChartsOf(const PanelSheet& sheet, const std::vector<TemplatePanel>& panels,
                            int quarter_turns) {
  std::vector<Chart> charts(panels.size());
  for (size_t p = 0; p < panels.size(); ++p) {
    charts[p].rows = panels[p].last_row - panels[p].first_row + 1;
    charts[p].cols = panels[p].last_col - panels[p].first_col + 1;
    if (quarter_turns % 2 == 1) std::swap(charts[p].rows, charts[p].cols);
    charts[p].top.assign(charts[p].cols, charts[p].rows);
    charts[p].bottom.assign(charts[p].cols, -1);
  }
  for (size_t v = 0; v < sheet.cell_of_vertex.size(); ++v) {
    const int p = sheet.panel_of_vertex[v];
    const auto [row, col] = PlaceInBox(panels[p], sheet.cell_of_vertex[v], quarter_turns);
    charts[p].top[col] = std::min(charts[p].top[col], row);
    charts[p].bottom[col] = std::max(charts[p].bottom[col], row);
  }
  return charts;
}

struct ChartPlace {
  int row = 0, col = 0, quarter_turns = 0;
};

// Charts [turns][panels] in a square of `side` cells without its margin; empty where they do not fit.
std::optional<std::vector<ChartPlace>> Drop(const std::vector<std::vector<Chart>>& charts,
                                            const std::vector<int>& order, int side, int gap) {
  std::vector<int> free_from(side, 0);  // first row below all that lies in a column
  std::vector<ChartPlace> places(order.size());
  for (const int p : order) {
    std::optional<ChartPlace> best;
    int best_end = side + 1;
    for (int turns = 0; turns < 4; ++turns) {
      const Chart& chart = charts[turns][p];
      for (int col = 0; col + chart.cols <= side; ++col) {
        int row = 0;
        for (int c = 0; c < chart.cols; ++c) row = std::max(row, free_from[col + c] - chart.top[c]);
        if (row + chart.rows >= best_end) continue;
        best_end = row + chart.rows;
        best = ChartPlace{row, col, turns};
      }
    }
    if (!best) return std::nullopt;
    const Chart& chart = charts[best->quarter_turns][p];
    for (int c = 0; c < chart.cols; ++c) {
      for (int at = std::max(0, best->col + c - gap); at <= std::min(side - 1, best->col + c + gap); ++at)
        free_from[at] = std::max(free_from[at], best->row + chart.bottom[c] + 1 + gap);
    }
    places[p] = *best;
  }
  return places;
}

}  // namespace

void PackCharts(const PanelSheet& sheet, double cell_mm, int gap_cells, GarmentParts* parts) {
  std::vector<TemplatePanel>& panels = parts->panels;
  std::vector<std::vector<Chart>> charts;
  for (int turns = 0; turns < 4; ++turns) charts.push_back(ChartsOf(sheet, panels, turns));
  std::vector<int> order(panels.size());
  std::iota(order.begin(), order.end(), 0);
  const auto longer_side = [&](int p) { return std::max(charts[0][p].rows, charts[0][p].cols); };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return longer_side(a) > longer_side(b); });
  int side = static_cast<int>(std::sqrt(static_cast<double>(sheet.cell_of_vertex.size())));
  std::optional<std::vector<ChartPlace>> places;
  while (!(places = Drop(charts, order, side, gap_cells))) ++side;

  const int margin = (gap_cells + 1) / 2;
  for (size_t p = 0; p < panels.size(); ++p) {
    panels[p].texture_row = (*places)[p].row + margin;
    panels[p].texture_col = (*places)[p].col + margin;
    panels[p].quarter_turns = (*places)[p].quarter_turns;
  }
  parts->texture_side_mm = (side + 2 * margin) * cell_mm;
  parts->texture_mm.clear();
  for (size_t v = 0; v < sheet.cell_of_vertex.size(); ++v) {
    const TemplatePanel& panel = panels[sheet.panel_of_vertex[v]];
    const auto [row, col] = PlaceInBox(panel, sheet.cell_of_vertex[v], panel.quarter_turns);
    parts->texture_mm.emplace_back((panel.texture_col + col + 0.5) * cell_mm,
                                   parts->texture_side_mm - (panel.texture_row + row + 0.5) * cell_mm);
  }
}

}  // namespace weft
