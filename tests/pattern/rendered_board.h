// A photograph of a printed board, made without any code of the decoder: curved paper, uneven light, blur,
// noise.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "capture/image/frame.h"
#include "pattern/board/board.h"

namespace weft {

struct Photograph {
  int width_px = 400, height_px = 360;
  double pitch_px = 6;
  double angle_deg = 20;
  double bend_cells = 0.6;  // how far the paper is from flat, sideways
  double squeeze = 1.0;     // along the board's columns: 0.6 shows cells at 60 % of their width
  double pleat = 1.0;    // along the columns: four of twelve cells are seen at this width, creased at centres
  double blur_px = 0.8;  // standard deviation
  double noise = 3;      // grey levels
  double fade = 0.35;    // inks mixed with grey
  double black = 0.12;   // ink lines
  bool mirrored = false;  // print-through: the board from behind
  // Only the cells [row, row + rows) x [col, col + cols) are printed; the rest is grey cloth.
  int row = 0, col = 0, rows = 1 << 20, cols = 1 << 20;
  uint32_t seed = 1;
};

// Columns from the middle at `width` cells from it, where pleats take less than their columns.
inline double ColumnsAcross(const Photograph& p, double width) {
  constexpr double kPeriod = 12, kFlat = 8;
  const double shown = kFlat + p.pleat * (kPeriod - kFlat), periods = std::floor((width - 0.5) / shown);
  const double within = width - 0.5 - periods * shown;
  return 0.5 + periods * kPeriod + (within < kFlat ? within : kFlat + (within - kFlat) / p.pleat);
}

// Board coordinates (columns u, rows v; cell (r, c) has its middle at (c + 0.5, r + 0.5)) of a pixel.
inline std::pair<double, double> BoardFromPixel(const Photograph& p, const Board& board, double x, double y) {
  const double angle = p.angle_deg * M_PI / 180;
  const double dx = x - 0.5 * (p.width_px - 1), dy = y - 0.5 * (p.height_px - 1);
  double u = (std::cos(angle) * dx + std::sin(angle) * dy) / (p.pitch_px * p.squeeze);
  double v = (-std::sin(angle) * dx + std::cos(angle) * dy) / p.pitch_px;
  u += p.bend_cells * std::sin(2 * M_PI * v / 23) + 0.5 * p.bend_cells * std::sin(2 * M_PI * u / 31);
  v += p.bend_cells * std::sin(2 * M_PI * u / 27 + 1);
  u = ColumnsAcross(p, u);
  if (p.mirrored) u = -u;
  return {u + 0.5 * board.cols, v + 0.5 * board.rows};
}

// The pixel of a point of the board, by fixed-point iteration.
inline std::pair<double, double> PixelFromBoard(const Photograph& p, const Board& board, double u, double v) {
  const double angle = p.angle_deg * M_PI / 180;
  double x = 0.5 * (p.width_px - 1), y = 0.5 * (p.height_px - 1);
  for (int k = 0; k < 200; ++k) {
    const auto [at_u, at_v] = BoardFromPixel(p, board, x, y);
    const double du = (p.mirrored ? at_u - u : u - at_u) * p.pitch_px * p.squeeze,
                 dv = (v - at_v) * p.pitch_px;
    x += 0.5 * (std::cos(angle) * du - std::sin(angle) * dv);
    y += 0.5 * (std::sin(angle) * du + std::cos(angle) * dv);
  }
  return {x, y};
}

inline bool Printed(const Photograph& p, const Board& board, int row, int col) {
  return board.Contains(row, col) && row >= p.row && row < p.row + p.rows && col >= p.col &&
         col < p.col + p.cols;
}

// Blurs one channel by a Gaussian, separably.
inline void Blur(int width, int height, double sigma, std::vector<double>* image) {
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  std::vector<double> taps;
  for (int k = -reach; k <= reach; ++k) taps.push_back(std::exp(-0.5 * k * k / (sigma * sigma)));
  double sum = 0;
  for (const double t : taps) sum += t;
  for (const auto& [step_x, step_y] : {std::pair{1, 0}, {0, 1}}) {
    std::vector<double> out(image->size(), 0.0);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int k = -reach; k <= reach; ++k) {
          const int xx = std::clamp(x + k * step_x, 0, width - 1),
                    yy = std::clamp(y + k * step_y, 0, height - 1);
          out[static_cast<size_t>(y) * width + x] +=
              taps[k + reach] / sum * (*image)[static_cast<size_t>(yy) * width + xx];
        }
      }
    }
    *image = std::move(out);
  }
}

inline Frame Render(const Photograph& p, const Board& board) {
  const size_t pixels = static_cast<size_t>(p.width_px) * p.height_px;
  std::vector<double> channels[3];
  for (auto& channel : channels) channel.assign(pixels, 0.0);
  constexpr int kSamples = 4;
  for (int y = 0; y < p.height_px; ++y) {
    for (int x = 0; x < p.width_px; ++x) {
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const double sx = (s % kSamples + 0.5) / kSamples - 0.5, sy = (s / kSamples + 0.5) / kSamples - 0.5;
        const auto [u, v] = BoardFromPixel(p, board, x + sx, y + sy);
        const int row = static_cast<int>(std::floor(v)), col = static_cast<int>(std::floor(u));
        double rgb[3] = {0.55, 0.55, 0.55};  // cloth
        if (Printed(p, board, row, col)) {
          const double half = board.square_fraction / 2;
          const bool ink = std::abs(u - col - 0.5) > half || std::abs(v - row - 0.5) > half;
          const auto color = CellColorRgb(board.at(row, col));
          const double grey = (color[0] + color[1] + color[2]) / 765.0;
          for (int c = 0; c < 3; ++c) rgb[c] = ink ? p.black : (1 - p.fade) * color[c] / 255 + p.fade * grey;
        }
        for (int c = 0; c < 3; ++c) {
          channels[c][static_cast<size_t>(y) * p.width_px + x] += rgb[c] / (kSamples * kSamples);
        }
      }
    }
  }
  std::mt19937 random(p.seed);
  std::normal_distribution<double> noise(0, p.noise);
  auto bytes = std::make_shared<std::vector<uint8_t>>(3 * pixels);
  for (int c = 0; c < 3; ++c) {
    Blur(p.width_px, p.height_px, p.blur_px, &channels[c]);
    for (size_t k = 0; k < pixels; ++k) {
      const double x = static_cast<double>(k % p.width_px) / p.width_px, light = 110 + 110 * x;
      (*bytes)[3 * k + c] =
          static_cast<uint8_t>(std::clamp(std::lround(light * channels[c][k] + 6 + noise(random)), 0L, 255L));
    }
  }
  Frame frame;
  frame.width_px = p.width_px;
  frame.height_px = p.height_px;
  frame.format = PixelFormat::kRgb8;
  frame.pixels = std::move(bytes);
  return frame;
}

}  // namespace weft
