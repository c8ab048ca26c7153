// Positions of an image that cells of a board have taken.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "pattern/fit/cell.h"
#include "pattern/image/pixel_allocator.h"

namespace weft {

class OccupiedPositions {
 public:
  OccupiedPositions(int width_px, int height_px)
      : columns_(width_px / kBucketPx + 1),
        rows_(height_px / kBucketPx + 1),
        newest_(static_cast<size_t>(columns_) * rows_, Middle()) {}

  // Takes the position of a cell whose middle is in the image, or near its border.
  void Take(const CellPose& pose, int row, int col) {
    Middle& newest =
        newest_[static_cast<size_t>(Bucket(pose.y, rows_)) * columns_ + Bucket(pose.x, columns_)];
    before_.push_back(newest);
    newest = {pose.x, pose.y, SquaredReach(pose), static_cast<int>(cells_.size())};
    cells_.push_back({row, col, pose});
  }

  // Fetches what IsTaken reads of most cells; the middle is in the image.
  void Prefetch(const CellPose& pose) const {
    const size_t bucket = static_cast<size_t>(static_cast<int>(pose.y) / kBucketPx) * columns_ +
                          static_cast<int>(pose.x) / kBucketPx;
    for (const size_t near : {bucket - columns_, bucket, bucket + columns_}) {
      if (near < newest_.size()) __builtin_prefetch(&newest_[near]);
    }
  }

  // Whether the middle lies within a cell, or a cell's middle within this one.
  bool IsTaken(const CellPose& pose) const { return CellAt(pose) >= 0; }

  // A cell of which that is so, by the order in which they were taken; -1 where there is none. The middle is
  // in the image.
  int CellAt(const CellPose& pose) const {
    const int bx = static_cast<int>(pose.x) / kBucketPx, by = static_cast<int>(pose.y) / kBucketPx;
    const int reach = 1 + static_cast<int>(std::sqrt(pose.Area())) / kBucketPx;
    const float squared = SquaredReach(pose);
    for (int y = std::max(0, by - reach); y <= std::min(rows_ - 1, by + reach); ++y) {
      for (int x = std::max(0, bx - reach); x <= std::min(columns_ - 1, bx + reach); ++x) {
        const Middle* other = &newest_[static_cast<size_t>(y) * columns_ + x];
        for (; other->cell >= 0; other = &before_[other->cell]) {
          const float dx = pose.x - other->x, dy = pose.y - other->y;
          if (dx * dx + dy * dy > std::max(squared, other->squared_reach)) continue;
          if (cells_[other->cell].pose.Contains(dx, dy) || pose.Contains(-dx, -dy)) return other->cell;
        }
      }
    }
    return -1;
  }

  // Adds the cells that the samples around a cell may lie on and that are far from it on the board, in
  // front of it or behind. The middle is in the image.
  void FindOccluders(const CellPose& pose, int row, int col, std::vector<CellPose>* occluders) const {
    constexpr float kSamplesReach = 1.75f;  // over that of the cell
    constexpr int kFar = 3;                 // rows or columns
    const float reach_px = kSamplesReach * std::sqrt(SquaredReach(pose));
    const int bx = static_cast<int>(pose.x) / kBucketPx, by = static_cast<int>(pose.y) / kBucketPx;
    const int reach = 1 + static_cast<int>(1.5f * reach_px) / kBucketPx;
    for (int y = std::max(0, by - reach); y <= std::min(rows_ - 1, by + reach); ++y) {
      for (int x = std::max(0, bx - reach); x <= std::min(columns_ - 1, bx + reach); ++x) {
        const Middle* other = &newest_[static_cast<size_t>(y) * columns_ + x];
        for (; other->cell >= 0; other = &before_[other->cell]) {
          const PlacedCell& cell = cells_[other->cell];
          if (std::max(std::abs(cell.row - row), std::abs(cell.col - col)) < kFar) continue;
          const float dx = pose.x - other->x, dy = pose.y - other->y;
          const float both_px = reach_px + std::sqrt(other->squared_reach);
          if (dx * dx + dy * dy < both_px * both_px) occluders->push_back(cell.pose);
        }
      }
    }
  }

 private:
  static constexpr int kBucketPx = 8;

  // What most comparisons need, near each other in memory for cells that are so in the image.
  struct Middle {
    float x = 0, y = 0;
    float squared_reach = 0;
    int cell = -1;
  };

  static int Bucket(float v, int count) { return std::clamp(static_cast<int>(v) / kBucketPx, 0, count - 1); }

  // No point of a cell is farther from its middle.
  static float SquaredReach(const CellPose& f) {
    return 0.5f * (f.ax * f.ax + f.ay * f.ay + f.bx * f.bx + f.by * f.by);
  }

  int columns_, rows_;
  PixelVector<Middle> newest_;  // [rows][columns], of the last one taken in each bucket
  PixelVector<Middle> before_;  // by cell, of the one taken before in its bucket
  PixelVector<PlacedCell> cells_;
};

}  // namespace weft
