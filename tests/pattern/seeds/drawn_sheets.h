// Sheets of cells drawn as keypoints and spots in closed form, with what is true of each keypoint.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "pattern/seeds/lattice.h"

namespace weft {

// A sheet of cells in the image: cell (row, col) is at origin + col a + row b.
struct Sheet {
  double x = 0, y = 0;
  double ax = 5, ay = 0, bx = 0, by = 5;
  int rows = 12, cols = 14;

  std::pair<double, double> Pixel(double row, double col) const {
    return {x + col * ax + row * bx, y + col * ay + row * by};
  }
  // Row and column of a pixel.
  std::pair<double, double> Cell(double px, double py) const {
    const double area = ax * by - ay * bx, dx = px - x, dy = py - y;
    return {(ax * dy - ay * dx) / area, (by * dx - bx * dy) / area};
  }
};

inline Sheet Turned(const Sheet& sheet, double angle_deg) {
  const double c = std::cos(angle_deg * M_PI / 180), s = std::sin(angle_deg * M_PI / 180);
  Sheet out = sheet;
  out.ax = c * sheet.ax - s * sheet.ay;
  out.ay = s * sheet.ax + c * sheet.ay;
  out.bx = c * sheet.bx - s * sheet.by;
  out.by = s * sheet.bx + c * sheet.by;
  return out;
}

// The middle of the sheet to (x, y).
inline Sheet MovedTo(double x, double y, Sheet sheet) {
  sheet.x = sheet.y = 0;
  const auto [mx, my] = sheet.Pixel(0.5 * (sheet.rows - 1), 0.5 * (sheet.cols - 1));
  sheet.x = x - mx;
  sheet.y = y - my;
  return sheet;
}

struct Origin {
  int sheet, row, col;  // sheet -1: spurious
};

// Sheets on dark ground, with what is true of each keypoint.
class Scene {
 public:
  explicit Scene(std::vector<Sheet> sheets, int side_px = 160) : sheets_(std::move(sheets)) {
    spots_ = {side_px, side_px, PixelVector<float>(static_cast<size_t>(side_px) * side_px)};
    for (int y = 0; y < side_px; ++y) {
      for (int x = 0; x < side_px; ++x) spots_.row(y)[x] = SpotAt(x, y);
    }
    for (size_t s = 0; s < sheets_.size(); ++s) {
      for (int row = 0; row < sheets_[s].rows; ++row) {
        for (int col = 0; col < sheets_[s].cols; ++col) {
          const auto [x, y] = sheets_[s].Pixel(row, col);
          points_.push_back({static_cast<float>(x), static_cast<float>(y), kPeak});
          origins_.push_back({static_cast<int>(s), row, col});
        }
      }
    }
  }

  void Jitter(double sigma_px, uint32_t seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> off(0, static_cast<float>(sigma_px));
    for (Keypoint& p : points_) {
      p.x_px += off(random);
      p.y_px += off(random);
    }
  }

  void Drop(double share, uint32_t seed) {
    std::mt19937 random(seed);
    for (size_t k = points_.size(); k-- > 0;) {
      if (random() >= share * 4294967296.0) continue;
      points_.erase(points_.begin() + static_cast<std::ptrdiff_t>(k));
      origins_.erase(origins_.begin() + static_cast<std::ptrdiff_t>(k));
    }
  }

  void AddSpurious(int count, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> at(2, static_cast<float>(spots_.width_px - 3));
    for (int k = 0; k < count; ++k) {
      points_.push_back({at(random), at(random), kPeak});
      origins_.push_back({-1, 0, 0});
    }
  }

  // Between the columns left and right of `col` + 0.5 of the first sheet.
  void RemoveInkRightOf(int col) {
    for (int y = 0; y < spots_.height_px; ++y) {
      for (int x = 0; x < spots_.width_px; ++x) {
        const double at = sheets_[0].Cell(x, y).second;
        if (at >= col && at <= col + 1) spots_.row(y)[x] = kPeak;
      }
    }
  }

  void RemoveInk() { std::fill(spots_.values.begin(), spots_.values.end(), kPeak); }

  std::vector<LatticePatch> Build(const LatticeOptions& options = {}) const {
    return BuildLattice(points_, spots_, options);
  }

  const Origin& OriginOf(const PatchCell& cell) const { return origins_[cell.keypoint]; }
  size_t size() const { return points_.size(); }

 private:
  static constexpr float kPeak = 0.3f;

  // Peaks of kPeak at the cells, edges at nought, corners below.
  float SpotAt(double x, double y) const {
    float spot = -kPeak;
    for (const Sheet& sheet : sheets_) {
      const auto [row, col] = sheet.Cell(x, y);
      if (row < -0.5 || col < -0.5 || row > sheet.rows - 0.5 || col > sheet.cols - 0.5) continue;
      spot = static_cast<float>(0.5 * kPeak * (std::cos(2 * M_PI * row) + std::cos(2 * M_PI * col)));
    }
    return spot;
  }

  std::vector<Sheet> sheets_;
  Plane spots_;
  std::vector<Keypoint> points_;
  std::vector<Origin> origins_;
};

}  // namespace weft
