// A photograph of a board as the steps over a view's surface read it, with what is true of its cells.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "pattern/fit/cell_fitter.h"
#include "pattern/surface/board_state.h"
#include "tests/pattern/fit/true_cells.h"
#include "tests/pattern/rendered_board.h"

namespace weft {

// The frame with grey cloth where covered(u, v) says so, in board coordinates.
template <typename Covered>
Frame CoveredWhere(const Frame& frame, const Photograph& photo, const Board& board, const Covered& covered) {
  auto bytes = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
  for (int y = 0; y < frame.height_px; ++y) {
    for (int x = 0; x < frame.width_px; ++x) {
      const auto [u, v] = BoardFromPixel(photo, board, x, y);
      if (!covered(u, v)) continue;
      for (int c = 0; c < 3; ++c) {
        (*bytes)[3 * (static_cast<size_t>(y) * frame.width_px + x) + c] =
            static_cast<uint8_t>(90 + (3 * x + 5 * y) % 7);
      }
    }
  }
  Frame out = frame;
  out.pixels = std::move(bytes);
  return out;
}

// The fitter of one frame, with all that it reads.
class FrameFitter {
 public:
  FrameFitter(const Frame& frame, const Photograph& photo, const Board& board)
      : pyramid_(HalvingsOf(frame, 1)),
        profile_(board.square_fraction),
        fitter_(pyramid_, board, profile_, TrueAppearance(photo)) {}
  FrameFitter(const FrameFitter&) = delete;
  FrameFitter& operator=(const FrameFitter&) = delete;

  const CellFitter& get() const { return fitter_; }

 private:
  std::vector<ColorImage> pyramid_;
  SampledProfile profile_;
  CellFitter fitter_;
};

inline PlacedCell TrueCell(const Photograph& photo, const Board& board, int row, int col) {
  return {row, col, TrueFrame(photo, board, row, col)};
}

// Distance of a cell from where it is, in cells.
inline double ErrorCells(const Photograph& photo, const Board& board, const ViewCell& cell) {
  const auto [x, y] = PixelFromBoard(photo, board, cell.col + 0.5, cell.row + 0.5);
  return std::hypot(cell.fit.pose.x - x, cell.fit.pose.y - y) / photo.pitch_px;
}

inline bool SamePose(const CellPose& f, const CellPose& g) {
  return f.x == g.x && f.y == g.y && f.ax == g.ax && f.ay == g.ay && f.bx == g.bx && f.by == g.by;
}

}  // namespace weft
