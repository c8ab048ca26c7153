#include "pattern/cell_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "rendered_board.h"

namespace weft {
namespace {

constexpr int kFirst = 24, kCells = 12;  // rows and columns of the board that are fitted

class CellMesh : public testing::Test {
 protected:
  void Fit(const Photograph& photo, double displaced_px) {
    const Frame frame = Render(photo, board_);
    std::vector<ColorImage> pyramid;
    pyramid.push_back(*ToColorImage(frame));
    const SampledProfile profile(board_.square_fraction);
    const CellFitter fitter(pyramid, board_, profile, AppearanceOf(photo));
    std::vector<GrownCell> cells;
    for (int row = kFirst; row < kFirst + kCells; ++row) {
      for (int col = kFirst; col < kFirst + kCells; ++col) {
        const auto at = [&](double u, double v) { return PixelFromBoard(photo, board_, u, v); };
        const auto [x, y] = at(col + 0.5, row + 0.5);
        const auto [left, left_y] = at(col, row + 0.5);
        const auto [right, right_y] = at(col + 1, row + 0.5);
        const auto [up, up_y] = at(col + 0.5, row);
        const auto [down, down_y] = at(col + 0.5, row + 1);
        GrownCell cell{row, col, {}, 0, 0};
        // Neighbours displaced against each other.
        const double off = (row + col) % 2 == 0 ? displaced_px : -displaced_px;
        const auto edge = [](double a, double b) { return static_cast<float>(b - a); };
        cell.fit.frame = {static_cast<float>(x + off),
                          static_cast<float>(y - off),
                          edge(left, right),
                          edge(left_y, right_y),
                          edge(up, down),
                          edge(up_y, down_y)};
        cells.push_back(cell);
        truth_.push_back({x, y});
      }
    }
    for (int sweep = 0; sweep < 3; ++sweep) SweepCenters(fitter, board_, 0, &cells);
    for (size_t k = 0; k < cells.size(); ++k) {
      const CellFrame& f = cells[k].fit.frame;
      // Cells at the border of those that are fitted have unknown neighbours.
      const int row = static_cast<int>(k) / kCells, col = static_cast<int>(k) % kCells;
      if (std::min({row, col, kCells - 1 - row, kCells - 1 - col}) < 2) continue;
      errors_px_.push_back(std::hypot(f.x - truth_[k].first, f.y - truth_[k].second));
    }
  }

  double LargestErrorPx() const { return *std::max_element(errors_px_.begin(), errors_px_.end()); }

  static Appearance AppearanceOf(const Photograph& photo) {
    constexpr float kLight = 160;  // typical; the fit finds what is really there
    Appearance look;
    look.sigma_px = static_cast<float>(photo.blur_px);
    for (int k = 0; k < kCellColors; ++k) {
      const auto rgb = CellColorRgb(static_cast<CellColor>(k));
      const double grey = (rgb[0] + rgb[1] + rgb[2]) / 765.0;
      for (int c = 0; c < 3; ++c) {
        look.inks[k][c] = kLight * static_cast<float>((1 - photo.fade) * rgb[c] / 255 + photo.fade * grey);
      }
    }
    look.black.fill(kLight * static_cast<float>(photo.black));
    return look;
  }

  const Board board_ = *GenerateBoard(60, 60, 3.0, 5);
  std::vector<std::pair<double, double>> truth_;
  std::vector<double> errors_px_;
};

TEST_F(CellMesh, BringsDisplacedCentersBack) {
  Fit({.width_px = 200, .height_px = 200, .pitch_px = 7, .bend_cells = 0.2, .noise = 0}, 0.3);
  // From 0.42 px, alternating from cell to cell, which is what the image says least about.
  EXPECT_LT(LargestErrorPx(), 0.25);
}

TEST_F(CellMesh, FindsCentersOnCreases) {
  Fit({.width_px = 200, .height_px = 200, .pitch_px = 7, .bend_cells = 0, .pleat = 0.6, .noise = 0}, 0);
  EXPECT_LT(LargestErrorPx(), 0.35);
}

}  // namespace
}  // namespace weft
