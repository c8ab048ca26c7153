// Where a cell is in the image, and how the print around it bends.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace weft {

// A cell's centre, and the edges to the next cells along the board's columns (a) and rows (b): an affine map
// from the board to the image, in px.
struct CellPose {
  float x = 0, y = 0;
  float ax = 0, ay = 0, bx = 0, by = 0;

  float Area() const { return ax * by - ay * bx; }
  float ShorterEdge() const { return std::sqrt(std::min(ax * ax + ay * ay, bx * bx + by * by)); }
  float LongerEdge() const { return std::sqrt(std::max(ax * ax + ay * ay, bx * bx + by * by)); }
  // Whether a point at (dx, dy) px from the centre is in the cell.
  bool Contains(float dx, float dy) const {
    const float half = 0.5f * Area();
    return std::abs(by * dx - bx * dy) < half && std::abs(ax * dy - ay * dx) < half;
  }
  // Of the cell so many columns and rows on, where flat print goes on.
  CellPose Shifted(float columns, float rows) const {
    return {x + (columns * ax + rows * bx), y + (columns * ay + rows * by), ax, ay, bx, by};
  }
  // In px of an image `scale` times smaller, whose pixel x is at (x + 0.5) scale - 0.5 of this one.
  CellPose InHalvings(float scale) const {
    const float s = 1 / scale;
    return {(x + 0.5f) * s - 0.5f, (y + 0.5f) * s - 0.5f, ax * s, ay * s, bx * s, by * s};
  }
};

// What a bilinear warp adds to a pose. At (u, v) cells from the centre, -1 to 1, the image position is that
// of the pose plus |u| fold_u + |v| fold_v + u v twist + u |v| fan_u + |u| v fan_v + |u v| rest; (x, y) each,
// in px.
struct CellWarp {
  float fold_u[2] = {}, fold_v[2] = {}, twist[2] = {}, fan_u[2] = {}, fan_v[2] = {}, rest[2] = {};

  // What it adds to x (k = 0) or y (1) at (u, v).
  float At(int k, float u, float v) const {
    const float abs_u = std::abs(u), abs_v = std::abs(v);
    return abs_u * fold_u[k] + abs_v * fold_v[k] + u * v * twist[k] + u * abs_v * fan_u[k] +
           abs_u * v * fan_v[k] + abs_u * abs_v * rest[k];
  }

  // In px of an image `scale` times smaller.
  CellWarp InHalvings(float scale) const {
    CellWarp warp = *this;
    for (float* v : {warp.fold_u, warp.fold_v, warp.twist, warp.fan_u, warp.fan_v, warp.rest}) {
      v[0] /= scale;
      v[1] /= scale;
    }
    return warp;
  }
};

// Centres of a cell and the eight around it, row by row, in px.
struct NineCenters {
  float x[9] = {}, y[9] = {};
};

// The pose and warp that interpolate bilinearly between nine centres.
inline void Interpolate(const NineCenters& centers, CellPose* pose, CellWarp* warp) {
  for (int k = 0; k < 2; ++k) {
    const float* n = k == 0 ? centers.x : centers.y;
    const float a = 0.5f * (n[5] - n[3]), b = 0.5f * (n[7] - n[1]);
    const float fold_u = 0.5f * (n[5] + n[3]) - n[4], fold_v = 0.5f * (n[7] + n[1]) - n[4];
    const float middle = n[4] + fold_u + fold_v;
    const float d0 = n[0] - middle + a + b, d2 = n[2] - middle - a + b, d6 = n[6] - middle + a - b,
                d8 = n[8] - middle - a - b;
    (k == 0 ? pose->x : pose->y) = n[4];
    (k == 0 ? pose->ax : pose->ay) = a;
    (k == 0 ? pose->bx : pose->by) = b;
    warp->fold_u[k] = fold_u;
    warp->fold_v[k] = fold_v;
    warp->twist[k] = 0.25f * (d0 - d2 - d6 + d8);
    warp->fan_u[k] = 0.25f * (d2 + d8 - d0 - d6);
    warp->fan_v[k] = 0.25f * (d6 + d8 - d0 - d2);
    warp->rest[k] = 0.25f * (d0 + d2 + d6 + d8);
  }
}

// A board cell at its position in the image.
struct PlacedCell {
  int row = 0;
  int col = 0;
  CellPose pose;
  int group = 0;         // cells that were read or grown from one piece of lattice have one number
  bool is_read = false;  // in a piece whose colours alone leave no doubt where on the board it is
};

// Weight of each cell of the 3x3 neighbourhood in a fit, row by row; the middle is the cell itself.
using NeighborWeights = std::array<float, 9>;

// Where a board cell is expected in a view.
struct PredictedCell {
  int row = 0;
  int col = 0;
  CellPose pose;
  NeighborWeights in_sight{};  // 1 where that cell is in sight beside this one, 0 where it is hidden
  float sigma_px = 0;          // of the position, per axis
};

}  // namespace weft
