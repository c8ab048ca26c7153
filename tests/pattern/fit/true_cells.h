// What is true of the cells of a rendered photograph, in the terms of the fit.
#pragma once

#include <cmath>
#include <vector>

#include "pattern/fit/appearance.h"
#include "pattern/fit/cell.h"
#include "tests/pattern/rendered_board.h"

namespace weft {

// Where a cell is, with the edges that its neighbours' centres span.
inline CellPose TrueFrame(const Photograph& photo, const Board& board, int row, int col) {
  const auto at = [&](double u, double v) {
    const auto [x, y] = PixelFromBoard(photo, board, u, v);
    return std::pair{static_cast<float>(x), static_cast<float>(y)};
  };
  const auto [x, y] = at(col + 0.5, row + 0.5);
  const auto [left_x, left_y] = at(col, row + 0.5);
  const auto [right_x, right_y] = at(col + 1, row + 0.5);
  const auto [up_x, up_y] = at(col + 0.5, row);
  const auto [down_x, down_y] = at(col + 0.5, row + 1);
  return {x, y, right_x - left_x, right_y - left_y, down_x - up_x, down_y - up_y};
}

// Centres of a cell and its eight neighbours.
inline NineCenters TrueNodes(const Photograph& photo, const Board& board, int row, int col) {
  NineCenters nodes;
  for (int k = 0; k < 9; ++k) {
    const auto [x, y] = PixelFromBoard(photo, board, col + k % 3 - 0.5, row + k / 3 - 0.5);
    nodes.x[k] = static_cast<float>(x);
    nodes.y[k] = static_cast<float>(y);
  }
  return nodes;
}

// Cells that lie in the picture with a margin in cells, every `step`th.
inline std::vector<PlacedCell> TrueCells(const Photograph& photo, const Board& board, double margin_cells,
                                         int step = 1) {
  std::vector<PlacedCell> cells;
  const double margin_px = margin_cells * photo.pitch_px;
  int n = 0;
  for (int row = 1; row + 1 < board.rows; ++row) {
    for (int col = 1; col + 1 < board.cols; ++col) {
      const auto [x, y] = PixelFromBoard(photo, board, col + 0.5, row + 0.5);
      if (x < margin_px || y < margin_px || x > photo.width_px - 1 - margin_px ||
          y > photo.height_px - 1 - margin_px || n++ % step != 0) {
        continue;
      }
      cells.push_back({row, col, TrueFrame(photo, board, row, col)});
    }
  }
  return cells;
}

// The inks of a photograph at a typical light; a fit finds the light that is really there.
inline Appearance TrueAppearance(const Photograph& photo) {
  constexpr float kLight = 160;
  Appearance appearance;
  // A pixel is the mean over its square.
  appearance.sigma_px = static_cast<float>(std::sqrt(photo.blur_px * photo.blur_px + 1.0 / 12));
  for (int k = 0; k < kCellColors; ++k) {
    const auto rgb = CellColorRgb(static_cast<CellColor>(k));
    const double grey = (rgb[0] + rgb[1] + rgb[2]) / 765.0;
    for (int c = 0; c < 3; ++c) {
      appearance.inks[k][c] =
          kLight * static_cast<float>((1 - photo.fade) * rgb[c] / 255 + photo.fade * grey);
    }
  }
  appearance.black.fill(kLight * static_cast<float>(photo.black));
  return appearance;
}

inline std::vector<ColorImage> HalvingsOf(const Frame& frame, int levels) {
  std::vector<ColorImage> pyramid = {*ToColorImage(frame)};
  while (static_cast<int>(pyramid.size()) < levels) pyramid.push_back(HalfSize(pyramid.back()));
  return pyramid;
}

}  // namespace weft
