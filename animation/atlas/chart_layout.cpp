#include "animation/atlas/chart_layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "alignment/garment_parts.h"
#include "alignment/template_build/chart_packing.h"

namespace weft {
namespace {

// A place within a box of texels after quarter turns clockwise; centres of texels have whole coordinates.
Eigen::Vector2d Turned(const Eigen::Vector2d& col_row, const TemplatePanel& panel) {
  const double rows = panel.last_row, cols = panel.last_col, col = col_row.x(), row = col_row.y();
  switch (panel.quarter_turns) {
    case 1:
      return {rows - row, col};
    case 2:
      return {cols - col, rows - row};
    case 3:
      return {row, cols - col};
    default:
      return col_row;
  }
}

using TexelKey = std::array<int, 3>;  // panel, row, column

class ChartGrid {
 public:
  ChartGrid(const ClothCharts& charts, int texel_cells)
      : texel_cells_(texel_cells), first_(charts.charts, {1e9, 1e9}) {
    for (size_t v = 0; v < charts.of_vertex.size(); ++v)
      if (charts.of_vertex[v] >= 0) Extend(charts.of_vertex[v], charts.vertex_cells[v]);
    for (size_t f = 0; f < charts.of_face.size(); ++f)
      if (charts.of_face[f] >= 0)
        for (const Eigen::Vector2d& corner : charts.corner_cells[f]) Extend(charts.of_face[f], corner);
  }

  // In texels from the panel's first row and column, centres at whole coordinates.
  Eigen::Vector2d PlaceOf(int panel, const Eigen::Vector2d& cells) const {
    return (cells - first_[panel]) / texel_cells_ - Eigen::Vector2d(0.5, 0.5);
  }
  // Of a corner on a texel's border, the texel after it.
  static Eigen::Vector2d TexelAt(const Eigen::Vector2d& place) {
    return place.array().unaryExpr([](double x) { return std::floor(x + 0.5); });
  }

 private:
  void Extend(int panel, const Eigen::Vector2d& cells) {
    first_[panel] = first_[panel].cwiseMin(Eigen::Vector2d(std::floor(cells.x()), std::floor(cells.y())));
  }

  const double texel_cells_;
  std::vector<Eigen::Vector2d> first_;  // [panels]
};

// Weights of a triangle's corners at a place; false outside of it.
bool WeightsAt(const std::array<Eigen::Vector2d, 3>& corners, const Eigen::Vector2d& at,
               std::array<double, 3>& weights) {
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const double area = cross(corners[1] - corners[0], corners[2] - corners[0]);
  if (area == 0) return false;
  for (size_t k = 0; k < 3; ++k) {
    const Eigen::Vector2d &b = corners[(k + 1) % 3], &c = corners[(k + 2) % 3];
    weights[k] = cross(b - at, c - at) / area;
    if (weights[k] < 0) return false;
  }
  return true;
}

TexelKey KeyOf(int panel, const Eigen::Vector2d& texel) {
  return {panel, static_cast<int>(texel.y()), static_cast<int>(texel.x())};
}

// Vertices where they are, then those of seams where other charts, or other borders, have them.
std::vector<ChartSeat> SeatsOf(const GarmentMesh& garment, const ClothCharts& charts, const ChartGrid& grid) {
  std::vector<ChartSeat> seats;
  const auto add = [&](int v, int panel, const Eigen::Vector2d& cells) {
    seats.push_back({v, panel, cells, grid.PlaceOf(panel, cells)});
  };
  for (size_t v = 0; v < charts.of_vertex.size(); ++v)
    if (charts.of_vertex[v] >= 0) add(static_cast<int>(v), charts.of_vertex[v], charts.vertex_cells[v]);
  std::set<std::pair<int, TexelKey>> seen;
  for (size_t f = 0; f < charts.of_face.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      const int v = garment.rest.faces[f][k], panel = charts.of_face[f];
      const Eigen::Vector2d& cells = charts.corner_cells[f][k];
      if (panel < 0 || (panel == charts.of_vertex[v] && cells == charts.vertex_cells[v])) continue;
      if (seen.emplace(v, KeyOf(panel, ChartGrid::TexelAt(grid.PlaceOf(panel, cells)))).second)
        add(v, panel, cells);
    }
  }
  return seats;
}

// By texels: `seats` are how many vertices lie in each.
std::vector<std::pair<TexelKey, ChartFill>> FillsOf(const GarmentMesh& garment, const ClothCharts& charts,
                                                    const ChartGrid& grid,
                                                    const std::map<TexelKey, int>& seats) {
  std::set<TexelKey> filled;
  std::vector<std::pair<TexelKey, ChartFill>> fills;
  for (size_t f = 0; f < charts.of_face.size(); ++f) {
    const int panel = charts.of_face[f];
    if (panel < 0) continue;
    std::array<Eigen::Vector2d, 3> corners;
    for (size_t k = 0; k < 3; ++k) corners[k] = grid.PlaceOf(panel, charts.corner_cells[f][k]);
    const Eigen::Vector2d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]),
                          high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
    for (int row = static_cast<int>(std::ceil(low.y())); row <= high.y(); ++row)
      for (int col = static_cast<int>(std::ceil(low.x())); col <= high.x(); ++col) {
        std::array<double, 3> weights;
        const TexelKey key = {panel, row, col};
        if (!WeightsAt(corners, Eigen::Vector2d(col, row), weights)) continue;
        if (const auto found = seats.find(key); found != seats.end() && found->second > 1) continue;
        if (!filled.insert(key).second) continue;
        ChartFill fill;
        fill.panel = panel;
        for (size_t k = 0; k < 3; ++k)
          fill.weights[k] = {garment.rest.faces[f][k], static_cast<float>(weights[k])};
        fills.emplace_back(key, fill);
      }
  }
  return fills;
}

// The panels of all texels, packed as if texels were cells.
GarmentParts Pack(const std::set<TexelKey>& texels, int panels, int gutter) {
  GarmentParts parts;
  parts.panels.resize(panels);
  PanelSheet sheet;
  sheet.panels = panels;
  for (const auto& [panel, row, col] : texels) {
    parts.panels[panel].last_row = std::max(parts.panels[panel].last_row, row);
    parts.panels[panel].last_col = std::max(parts.panels[panel].last_col, col);
    sheet.panel_of_vertex.push_back(panel);
    sheet.cell_of_vertex.push_back({row, col, NodeKind::kCenter});
  }
  PackCharts(sheet, 1, 2 * gutter, &parts);
  return parts;
}

}  // namespace

ChartLayout LayOutCharts(const GarmentMesh& garment, const ClothCharts& charts, int texel_cells, int gutter) {
  const ChartGrid grid(charts, texel_cells);
  ChartLayout out;
  out.seats = SeatsOf(garment, charts, grid);
  const auto key_of = [](const ChartSeat& seat) { return KeyOf(seat.panel, ChartGrid::TexelAt(seat.place)); };
  std::map<TexelKey, int> seats;
  for (const ChartSeat& seat : out.seats) ++seats[key_of(seat)];
  const std::vector<std::pair<TexelKey, ChartFill>> fills = FillsOf(garment, charts, grid, seats);
  std::set<TexelKey> texels, filled;
  for (const auto& [key, unused] : seats) texels.insert(key);
  for (const auto& [key, unused] : fills) texels.insert(key), filled.insert(key);
  const GarmentParts parts = Pack(texels, charts.charts, gutter);
  // The square that they were packed into ends where they end.
  for (const TemplatePanel& panel : parts.panels) {
    const bool upright = panel.quarter_turns % 2 == 0;
    out.cols =
        std::max(out.cols, panel.texture_col + 1 + (upright ? panel.last_col : panel.last_row) + gutter);
    out.rows =
        std::max(out.rows, panel.texture_row + 1 + (upright ? panel.last_row : panel.last_col) + gutter);
  }
  const auto in_image = [&](int p, const Eigen::Vector2d& place) {
    const TemplatePanel& panel = parts.panels[p];
    return Eigen::Vector2d(Eigen::Vector2d(panel.texture_col, panel.texture_row) + Turned(place, panel));
  };
  for (ChartSeat& seat : out.seats) {
    seat.is_in_fill = filled.contains(key_of(seat));
    seat.texel = in_image(seat.panel, ChartGrid::TexelAt(seat.place)).cast<int>();
    seat.place = in_image(seat.panel, seat.place);
  }
  for (auto [key, fill] : fills) {
    fill.texel = in_image(fill.panel, Eigen::Vector2d(key[2], key[1])).cast<int>();
    out.fills.push_back(fill);
  }
  return out;
}

}  // namespace weft
