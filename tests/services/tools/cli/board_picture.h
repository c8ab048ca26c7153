// Plain pictures of a board, whose nodes lie where arithmetic puts them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "capture/image/image_file.h"
#include "pattern/board/board.h"

namespace weft {

// Each pixel the binomial mean of the 5 (1 4 6 4 1) around it along one axis. What
// lies beyond the first or last pixel counts as that pixel.
inline std::vector<uint8_t> Softened(const std::vector<uint8_t>& pixels, int width_px, int height_px,
                                     bool along_x) {
  constexpr int kWeights[5] = {1, 4, 6, 4, 1};
  std::vector<uint8_t> soft(pixels.size());
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      for (int c = 0; c < 3; ++c) {
        int sum = 8;
        for (int k = -2; k <= 2; ++k) {
          const int from_x = along_x ? std::clamp(x + k, 0, width_px - 1) : x;
          const int from_y = along_x ? y : std::clamp(y + k, 0, height_px - 1);
          sum += kWeights[k + 2] * pixels[(static_cast<size_t>(from_y) * width_px + from_x) * 3 + c];
        }
        soft[(static_cast<size_t>(y) * width_px + x) * 3 + c] = static_cast<uint8_t>(sum / 16);
      }
    }
  }
  return soft;
}

// Cells of `cell_px` pixels, an eighth of ink on each side, upright, on a grey margin, as soft as
// a lens makes them. The centre of cell (r,
// c) lies at margin + (c + 0.5) * cell_px - 0.5 in x, likewise in y.
inline Frame PictureOfBoard(const Board& board, int cell_px, int margin_px) {
  Frame frame;
  frame.width_px = board.cols * cell_px + 2 * margin_px;
  frame.height_px = board.rows * cell_px + 2 * margin_px;
  frame.format = PixelFormat::kRgb8;
  std::vector<uint8_t> pixels(static_cast<size_t>(frame.width_px) * frame.height_px * 3, 90);
  const int ink_px = cell_px / 8;
  for (int y = 0; y < board.rows * cell_px; ++y) {
    for (int x = 0; x < board.cols * cell_px; ++x) {
      const int in_x = x % cell_px, in_y = y % cell_px;
      const bool ink = in_x < ink_px || in_y < ink_px || in_x >= cell_px - ink_px || in_y >= cell_px - ink_px;
      const auto rgb = CellColorRgb(board.at(y / cell_px, x / cell_px));
      uint8_t* pixel = &pixels[(static_cast<size_t>(y + margin_px) * frame.width_px + x + margin_px) * 3];
      for (int c = 0; c < 3; ++c) pixel[c] = ink ? uint8_t{15} : static_cast<uint8_t>(rgb[c] * 4 / 5);
    }
  }
  pixels = Softened(pixels, frame.width_px, frame.height_px, true);
  pixels = Softened(pixels, frame.width_px, frame.height_px, false);
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(std::move(pixels));
  return frame;
}

}  // namespace weft
