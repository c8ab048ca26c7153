// Places of an image that cells have taken.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "pattern/cell_frame.h"
#include "pattern/pixel_allocator.h"

namespace weft {

class OccupiedPlaces {
 public:
  OccupiedPlaces(int width_px, int height_px)
      : columns_(width_px / kBucketPx + 1),
        rows_(height_px / kBucketPx + 1),
        newest_(static_cast<size_t>(columns_) * rows_, Middle()) {}

  // Takes the place of a cell whose middle is in the image.
  void Take(const CellFrame& frame) {
    Middle& newest = newest_[static_cast<size_t>(static_cast<int>(frame.y) / kBucketPx) * columns_ +
                             static_cast<int>(frame.x) / kBucketPx];
    before_.push_back(newest);
    newest = {frame.x, frame.y, SquaredReach(frame), static_cast<int>(frames_.size())};
    frames_.push_back(frame);
  }

  // Fetches what AreTaken reads of most cells; the middle is in the image.
  void Prefetch(const CellFrame& frame) const {
    const size_t bucket = static_cast<size_t>(static_cast<int>(frame.y) / kBucketPx) * columns_ +
                          static_cast<int>(frame.x) / kBucketPx;
    for (const size_t near : {bucket - columns_, bucket, bucket + columns_}) {
      if (near < newest_.size()) __builtin_prefetch(&newest_[near]);
    }
  }

  // Whether the middle lies within a cell, or a cell's middle within this one.
  bool AreTaken(const CellFrame& frame) const {
    const int bx = static_cast<int>(frame.x) / kBucketPx, by = static_cast<int>(frame.y) / kBucketPx;
    const int reach = 1 + static_cast<int>(std::sqrt(frame.Area())) / kBucketPx;
    const float squared = SquaredReach(frame);
    for (int y = std::max(0, by - reach); y <= std::min(rows_ - 1, by + reach); ++y) {
      for (int x = std::max(0, bx - reach); x <= std::min(columns_ - 1, bx + reach); ++x) {
        const Middle* other = &newest_[static_cast<size_t>(y) * columns_ + x];
        for (; other->frame >= 0; other = &before_[other->frame]) {
          const float dx = frame.x - other->x, dy = frame.y - other->y;
          if (dx * dx + dy * dy > std::max(squared, other->squared_reach)) continue;
          if (Inside(frames_[other->frame], dx, dy) || Inside(frame, -dx, -dy)) return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr int kBucketPx = 8;

  // What most comparisons need, near each other in memory for cells that are so in the image.
  struct Middle {
    float x = 0, y = 0;
    float squared_reach = 0;
    int frame = -1;
  };

  // No point of a cell is farther from its middle.
  static float SquaredReach(const CellFrame& f) {
    return 0.5f * (f.ax * f.ax + f.ay * f.ay + f.bx * f.bx + f.by * f.by);
  }

  // Whether a point at (dx, dy) from the middle is in the cell.
  static bool Inside(const CellFrame& f, float dx, float dy) {
    const float half = 0.5f * f.Area();
    return std::abs(f.by * dx - f.bx * dy) < half && std::abs(f.ax * dy - f.ay * dx) < half;
  }

  int columns_, rows_;
  PixelVector<Middle> newest_;  // [rows][columns], of the last one taken in each bucket
  std::vector<Middle> before_;  // by cell, of the one taken before in its bucket
  std::vector<CellFrame> frames_;
};

}  // namespace weft
