#include "pattern/surface/center_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

constexpr int kFirstSwept = 24, kCells = 12;  // rows and columns of the board that are fitted

struct Bend {
  std::function<double(double)> bent = [](double x) { return x; };  // where x of the photograph is
  double last_inward_px = 0;                                        // how far the last column starts off
};

class CenterSweeps : public testing::Test {
 protected:
  void Fit(const Photograph& photo, double displaced_px) { Fit(photo, Render(photo, board_), displaced_px); }

  void Fit(const Photograph& photo, const Frame& frame, double displaced_px, const Bend& bend = {}) {
    truth_.clear();
    offsets_px_.clear();
    all_errors_px_.clear();
    errors_px_.clear();
    std::vector<ColorImage> pyramid;
    pyramid.push_back(*ToColorImage(frame));
    const SampledProfile profile(board_.square_fraction);
    const CellFitter fitter(pyramid, board_, profile, AppearanceOf(photo));
    BoardState state(board_, photo.width_px, photo.height_px);
    for (int row = kFirstSwept; row < kFirstSwept + kCells; ++row) {
      for (int col = kFirstSwept; col < kFirstSwept + kCells; ++col) {
        const auto at = [&](double u, double v) {
          const auto [flat_x, flat_y] = PixelFromBoard(photo, board_, u, v);
          return std::pair(bend.bent(flat_x), flat_y);
        };
        const auto [x, y] = at(col + 0.5, row + 0.5);
        const auto [left, left_y] = at(col, row + 0.5);
        const auto [right, right_y] = at(col + 1, row + 0.5);
        const auto [up, up_y] = at(col + 0.5, row);
        const auto [down, down_y] = at(col + 0.5, row + 1);
        const double inward = col == kFirstSwept + kCells - 1 ? bend.last_inward_px : 0;
        ViewCell cell{row, col, {}, 0, 0, 0};
        cell.fit.moved_cells = 1;
        // Neighbours displaced against each other.
        const double off = (row + col) % 2 == 0 ? displaced_px : -displaced_px;
        const auto edge = [](double a, double b) { return static_cast<float>(b - a); };
        cell.fit.pose = {static_cast<float>(x + off - inward),
                         static_cast<float>(y - off),
                         edge(left, right),
                         edge(left_y, right_y),
                         edge(up, down),
                         edge(up_y, down_y)};
        state.Add(cell);
        truth_.push_back({x, y});
      }
    }
    for (int sweep = 0; sweep < 3; ++sweep) SweepUnsettled(fitter, 0, &state);
    for (size_t k = 0; k < state.cells().size(); ++k) {
      const CellPose& f = state.cells()[k].fit.pose;
      const double error_px = std::hypot(f.x - truth_[k].first, f.y - truth_[k].second);
      offsets_px_.push_back({f.x - truth_[k].first, f.y - truth_[k].second});
      all_errors_px_.push_back(error_px);
      // Cells at the border of those that are fitted have unknown neighbours.
      const int row = static_cast<int>(k) / kCells, col = static_cast<int>(k) % kCells;
      if (std::min({row, col, kCells - 1 - row, kCells - 1 - col}) < 2) continue;
      errors_px_.push_back(error_px);
    }
  }

  double MeanErrorOfLastColumnPx() const {
    double sum_px = 0;
    for (int row = 2; row < kCells - 2; ++row) sum_px += all_errors_px_[row * kCells + kCells - 1];
    return sum_px / (kCells - 4);
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
  std::vector<std::pair<double, double>> truth_, offsets_px_;  // [kCells][kCells]
  std::vector<double> all_errors_px_, errors_px_;  // [kCells][kCells]; without those at the border
};

TEST_F(CenterSweeps, BringsDisplacedCentersBack) {
  Fit({.width_px = 200, .height_px = 200, .pitch_px = 7, .bend_cells = 0.2, .noise = 0}, 0.3);
  // From 0.42 px, alternating from cell to cell, which is what the image says least about.
  EXPECT_LT(LargestErrorPx(), 0.25);
}

TEST_F(CenterSweeps, NeighborsShareOutTheNoise) {
  Fit({.width_px = 200, .height_px = 200, .pitch_px = 5, .bend_cells = 0.2, .blur_px = 1.0, .noise = 20}, 0);
  double squares = 0, alternating = 0;
  for (int row = 2; row < kCells - 3; ++row) {
    for (int col = 2; col < kCells - 3; ++col) {
      const auto* here = &offsets_px_[row * kCells + col];
      for (const double mixed :
           {here[0].first - here[1].first - here[kCells].first + here[kCells + 1].first,
            here[0].second - here[1].second - here[kCells].second + here[kCells + 1].second})
        alternating += mixed * mixed;
      squares += here->first * here->first + here->second * here->second;
    }
  }
  // Errors that know nothing of each other have a ratio of 4, alternating ones of 16.
  EXPECT_LT(alternating / squares, 1.5);
}

TEST_F(CenterSweeps, FindsCentersOnCreases) {
  Fit({.width_px = 200, .height_px = 200, .pitch_px = 7, .bend_cells = 0, .pleat = 0.6, .noise = 0}, 0);
  EXPECT_LT(LargestErrorPx(), 0.35);
}

TEST_F(CenterSweeps, WhatCoversABorderCellPullsLittleAtIt) {
  const Photograph photo{.width_px = 200, .height_px = 200, .pitch_px = 8, .angle_deg = 0, .bend_cells = 0};
  Frame frame = Render(photo, board_);
  // Bright cloth in front of the right fifth of the last column.
  const double edge_px = PixelFromBoard(photo, board_, kFirstSwept + kCells - 0.2, kFirstSwept).first;
  auto pixels = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
  for (int y = 0; y < frame.height_px; ++y) {
    for (int x = static_cast<int>(std::ceil(edge_px)); x < frame.width_px; ++x)
      std::fill_n(&(*pixels)[3 * (static_cast<size_t>(y) * frame.width_px + x)], 3, 150);
  }
  frame.pixels = pixels;
  Fit(photo, frame, 0);
  // A fit that trusts all samples alike is off by 1.7 px.
  EXPECT_LT(MeanErrorOfLastColumnPx(), 1.2);
}

// Print that turns away from the camera over a cylinder, in front of other print.
class Fold {
 public:
  Fold(double first_px, double radius_px) : first_px_(first_px), radius_px_(radius_px) {}

  // Where x of the flat print is; it must be on the near side.
  double Bent(double x) const {
    return x < first_px_ ? x : first_px_ + radius_px_ * std::sin((x - first_px_) / radius_px_);
  }

  Frame Photograph(const Frame& flat) const {
    constexpr double kBehindPx = 37;  // where the print behind the fold comes from
    constexpr int kParts = 8;         // of a pixel
    auto pixels = std::make_shared<std::vector<uint8_t>>(*flat.pixels);
    for (int x = 0; x < flat.width_px; ++x) {
      for (int y = 0; y < flat.height_px; ++y) {
        for (int c = 0; c < 3; ++c) {
          double sum = 0;
          for (int k = 0; k < kParts; ++k) {
            const double along = x - first_px_ + (k + 0.5) / kParts - 0.5;
            const double from = along < 0            ? first_px_ + along
                                : along < radius_px_ ? first_px_ + radius_px_ * std::asin(along / radius_px_)
                                                     : first_px_ + along - kBehindPx;
            const double inside = std::clamp(from, 0.0, flat.width_px - 1.001);
            const auto left = static_cast<int>(inside);
            const uint8_t* p = &(*flat.pixels)[3 * (static_cast<size_t>(y) * flat.width_px + left) + c];
            sum += p[0] + (inside - left) * (p[3] - p[0]);
          }
          (*pixels)[3 * (static_cast<size_t>(y) * flat.width_px + x) + c] =
              static_cast<uint8_t>(std::lround(sum / kParts));
        }
      }
    }
    Frame frame = flat;
    frame.pixels = pixels;
    return frame;
  }

 private:
  double first_px_, radius_px_;
};

TEST_F(CenterSweeps, FindCentersJustBehindTheCrestOfAFold) {
  constexpr double kBehindCells = 0.1;
  const Photograph photo{
      .width_px = 200, .height_px = 200, .pitch_px = 8, .angle_deg = 0, .bend_cells = 0, .noise = 0};
  const Frame flat = Render(photo, board_);
  const double last_px = PixelFromBoard(photo, board_, kFirstSwept + kCells - 0.5, kFirstSwept).first;
  std::vector<double> errors_px;
  for (const double radius_cells : {0.05, 0.3, 0.6, 1.0}) {
    for (const double inward_px : {0.0, 1.0, 2.0}) {
      const double radius_px = radius_cells * photo.pitch_px;
      const Fold fold(last_px - kBehindCells * photo.pitch_px - std::numbers::pi / 2 * radius_px, radius_px);
      Fit(photo, fold.Photograph(flat), 0, {[&](double x) { return fold.Bent(x); }, inward_px});
      errors_px.push_back(MeanErrorOfLastColumnPx());
    }
  }
  // 0.90 px where hidden edges have the length of those before.
  EXPECT_LT(std::accumulate(errors_px.begin(), errors_px.end(), 0.0) / errors_px.size(), 0.8);
}

}  // namespace
}  // namespace weft
