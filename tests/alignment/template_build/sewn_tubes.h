// Tubes of cloth cut from a board in known ways, and clouds of them in closed form.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "pattern/board/board.h"
#include "triangulation/cloud.h"

namespace weft::testing {

inline constexpr double kPitchMm = 3;

// A rectangle of a tube's surface, `width` by `height` cells, cut from the board: its upper left corner lies
// at cell coordinates (x, y) of the board, turned by `turn_deg`. On the tube it starts `around` cells from
// the tube's zero line and `down` cells from its upper end.
struct TubePanel {
  double width, height;
  double x, y;
  double around, down;
  double turn_deg = 0;
};

struct Tube {
  int rows, cols;  // of the board
  double around;   // circumference in cells
  std::vector<TubePanel> panels;
};

inline Board PlainBoard(const Tube& tube) {
  Board board{"tube", tube.rows, tube.cols, kPitchMm, 0.75, {}};
  for (int i = 0; i < tube.rows * tube.cols; ++i) {
    board.cells.push_back(static_cast<CellColor>((i % tube.cols + 3 * (i / tube.cols)) % kCellColors));
  }
  return board;
}

// All cells whose centres lie within a panel, at their places on the tube; the print is outside.
inline Cloud TubeCloud(const Tube& tube) {
  Cloud cloud;
  const double radius_mm = tube.around * kPitchMm / (2 * std::numbers::pi);
  for (int row = 0; row < tube.rows; ++row) {
    for (int col = 0; col < tube.cols; ++col) {
      for (const TubePanel& panel : tube.panels) {
        const double turn = panel.turn_deg * std::numbers::pi / 180;
        const double dx = col + 0.5 - panel.x, dy = row + 0.5 - panel.y;
        const double u = dx * std::cos(turn) + dy * std::sin(turn);
        const double v = -dx * std::sin(turn) + dy * std::cos(turn);
        if (u < 0 || v < 0 || u > panel.width || v > panel.height) continue;
        // Seen from outside with z up, the angle grows to the right.
        const double angle = (panel.around + u) * kPitchMm / radius_mm;
        CloudPoint point;
        point.position_mm = {radius_mm * std::cos(angle), radius_mm * std::sin(angle),
                             -(panel.down + v) * kPitchMm};
        point.node = {row, col, NodeKind::kCenter};
        point.views = 3;
        cloud.points.push_back(point);
      }
    }
  }
  return cloud;
}

// The same with noise, round patches that no camera saw, and some points that are plainly wrong.
inline Cloud Worn(Cloud cloud, double noise_mm, int patches, int wrong, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, noise_mm);
  std::uniform_int_distribution<size_t> any(0, cloud.points.size() - 1);
  std::vector<BoardNode> middles;
  for (int i = 0; i < patches; ++i) middles.push_back(cloud.points[any(random)].node);
  for (int i = 0; i < wrong; ++i) cloud.points[any(random)].position_mm += Eigen::Vector3d(40, -30, 20);
  std::erase_if(cloud.points, [&](const CloudPoint& point) {
    for (const BoardNode& middle : middles) {
      if (std::hypot(point.node.row - middle.row, point.node.col - middle.col) < 4) return true;
    }
    return false;
  });
  for (CloudPoint& point : cloud.points) {
    point.position_mm += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  return cloud;
}

// One panel, its two sides sewn to each other, `gap` cells apart.
inline Tube OnePanel(double gap = 1) { return {34, 70, 60 + gap, {{60, 30, 5, 2, 0, 0}}}; }

// Two halves, the second cut at an angle, so that its sides are stairs.
inline Tube TwoPanels(double turn_deg) {
  return {100, 120, 72, {{35, 40, 3, 3, 0.5, 0}, {35, 40, 80, 20, 36.5, 0, turn_deg}}};
}

// One panel above, two below: at two places three panels meet.
inline Tube ThreePanels() {
  return {60, 80, 61, {{60, 20, 3, 3, 0, 0}, {30, 25, 3, 28, 15, 21}, {29, 25, 40, 28, 46, 21}}};
}

// Two above, two below: at two places four panels meet.
inline Tube FourPanels() {
  return {60,
          80,
          62,
          {{30, 20, 3, 3, 0, 0}, {30, 20, 40, 3, 31, 0}, {30, 25, 3, 28, 0, 21}, {30, 25, 40, 28, 31, 21}}};
}

}  // namespace weft::testing
