// Where a cell is in the image, and how its surroundings bend.
#pragma once

#include <algorithm>
#include <cmath>

namespace weft {

// A cell's centre, and the edges to the next cells along the board's columns (a) and rows (b), all in px.
struct CellFrame {
  float x = 0, y = 0;
  float ax = 0, ay = 0, bx = 0, by = 0;

  float Area() const { return ax * by - ay * bx; }
  float ShorterEdge() const { return std::sqrt(std::min(ax * ax + ay * ay, bx * bx + by * by)); }
  // In px of an image `scale` times smaller, whose pixel x is at (x + 0.5) scale - 0.5 of this one.
  CellFrame InHalvings(float scale) const {
    const float s = 1 / scale;
    return {(x + 0.5f) * s - 0.5f, (y + 0.5f) * s - 0.5f, ax * s, ay * s, bx * s, by * s};
  }
};

// Second derivatives of the image position over board columns (u) and rows (v), in px: how a cell's
// surroundings bend away from its frame.
struct CellCurvature {
  float uu_x = 0, uu_y = 0, uv_x = 0, uv_y = 0, vv_x = 0, vv_y = 0;
};

// A board cell at its place in the image.
struct PlacedCell {
  int row = 0;
  int col = 0;
  CellFrame frame;
};

}  // namespace weft
