// The pixels around one cell, in the cell's own coordinates. For cell_fitter.cpp and appearance.cpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "pattern/appearance.h"
#include "pattern/blurred_profile.h"
#include "pattern/board.h"
#include "pattern/cell_frame.h"
#include "pattern/color_image.h"

namespace weft {

using Float4 = float __attribute__((vector_size(16)));

inline Float4 LoadPixel(const uint8_t* rgbx) {
  return Float4{static_cast<float>(rgbx[0]), static_cast<float>(rgbx[1]), static_cast<float>(rgbx[2]), 0};
}
inline Float4 Splat(float v) { return Float4{v, v, v, v}; }
inline float SumOf(Float4 v) { return v[0] + v[1] + v[2]; }
inline Float4 FromRgb(const Rgb& c) { return Float4{c[0], c[1], c[2], 0}; }

// A cell's surroundings: pixel (x, y) is at u columns and v rows from the middle of the cell.
struct CellWindow {
  CellFrame frame;
  float reach = 0;       // largest |u| and |v|
  float ux, uy, vx, vy;  // u = ux (x - frame.x) + uy (y - frame.y)
  CellCurvature bend;    // in cells
  int y_first, y_last;
  const BlurredProfile::Entry* along_u;
  const BlurredProfile::Entry* along_v;
  int labels[5][5];     // ink of the cells around, kCellColors off the board
  Float4 colors[5][5];  // minus black
  Float4 black;

  void SetColors(const Board& board, const Appearance& appearance, int row, int col) {
    black = FromRgb(appearance.black);
    for (int i = 0; i < 5; ++i) {
      for (int j = 0; j < 5; ++j) {
        const int r = row + i - 2, c = col + j - 2;
        const bool inside = board.Contains(r, c);
        labels[i][j] = inside ? static_cast<int>(board.at(r, c)) : kCellColors;
        colors[i][j] = inside ? FromRgb(appearance.inks[labels[i][j]]) - black : Float4{};
      }
    }
  }

  // False where the window is degenerate or outside of the image.
  bool Place(const CellFrame& at, const CellCurvature& curvature, float size, const ColorImage& image,
             const BlurredProfile& profile, float sigma_px) {
    const float area = at.Area();
    if (!(area > 1.0f) || area > 4000.0f) return false;
    frame = at;
    reach = size;
    ux = at.by / area;
    uy = -at.bx / area;
    vx = -at.ay / area;
    vy = at.ax / area;
    bend.uu_x = 0.5f * (ux * curvature.uu_x + uy * curvature.uu_y);
    bend.uu_y = 0.5f * (vx * curvature.uu_x + vy * curvature.uu_y);
    bend.uv_x = ux * curvature.uv_x + uy * curvature.uv_y;
    bend.uv_y = vx * curvature.uv_x + vy * curvature.uv_y;
    bend.vv_x = 0.5f * (ux * curvature.vv_x + uy * curvature.vv_y);
    bend.vv_y = 0.5f * (vx * curvature.vv_x + vy * curvature.vv_y);
    const float half_x = reach * (std::abs(at.ax) + std::abs(at.bx));
    const float half_y = reach * (std::abs(at.ay) + std::abs(at.by));
    if (!(at.x + half_x >= 0) || !(at.x - half_x <= static_cast<float>(image.width_px))) return false;
    if (!(at.y + half_y >= 0) || !(at.y - half_y <= static_cast<float>(image.height_px))) return false;
    y_first = std::max(0, static_cast<int>(std::ceil(at.y - half_y)));
    y_last = std::min(image.height_px - 1, static_cast<int>(std::floor(at.y + half_y)));
    along_u = profile.Row(sigma_px * std::sqrt(ux * ux + uy * uy));
    along_v = profile.Row(sigma_px * std::sqrt(vx * vx + vy * vy));
    return true;
  }

  // Calls visit(pixel, u, v) for every `stride`-th pixel with |u| and |v| below `reach`.
  template <typename Visit>
  void ForEachPixel(const ColorImage& image, int stride, Visit visit) const {
    for (int y = y_first; y <= y_last; y += stride) {
      const float dy = static_cast<float>(y) - frame.y;
      const float u0 = uy * dy, v0 = vy * dy;
      // |u0 + ux t| < reach and |v0 + vx t| < reach, t = x - frame.x.
      float low = -1e4f, high = 1e4f;
      bool empty = false;
      for (const auto& [offset, slope] : {std::pair{u0, ux}, std::pair{v0, vx}}) {
        if (std::abs(slope) < 1e-6f) {
          empty |= std::abs(offset) >= reach;
          continue;
        }
        const float p = (-reach - offset) / slope, q = (reach - offset) / slope;
        low = std::max(low, std::min(p, q));
        high = std::min(high, std::max(p, q));
      }
      if (empty || low > high) continue;
      const int x_first = std::max(0, static_cast<int>(std::ceil(frame.x + low)));
      const int x_last = std::min(image.width_px - 1, static_cast<int>(std::floor(frame.x + high)));
      for (int x = x_first; x <= x_last; x += stride) {
        const float dx = static_cast<float>(x) - frame.x;
        // The position is (u, v) + bend(u, v) seen through the frame: two steps of the fixed point.
        const float ua = u0 + ux * dx, va = v0 + vx * dx;
        float u = ua, v = va;
        for (int k = 0; k < 2; ++k) {
          const float uu = u * u, uv = u * v, vv = v * v;
          u = ua - (bend.uu_x * uu + bend.uv_x * uv + bend.vv_x * vv);
          v = va - (bend.uu_y * uu + bend.uv_y * uv + bend.vv_y * vv);
        }
        if (!(std::abs(u) < reach) || !(std::abs(v) < reach)) continue;
        visit(image.at(x, y), u, v);
      }
    }
  }
};

}  // namespace weft
