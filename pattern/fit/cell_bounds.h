// Which samples of a cell can be seen.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "pattern/fit/cell.h"
#include "pattern/fit/sampled_profile.h"

namespace weft {

// A weight per sample of a cell.
struct alignas(64) SampleMask {
  std::array<float, kSampleGroups * kSampleLanes> weights;
};

// Whether the samples of a cell are in the image: all, some or none.
enum class Inside { kAll, kSome, kNone };
inline Inside WhereIs(const CellPose& f, const CellWarp& warp, int width_px, int height_px) {
  const auto half = [&warp](float a, float b, int k) {
    constexpr float kReach = 0.875f;
    return kReach * (std::abs(a) + std::abs(b) + std::abs(warp.fold_u[k]) + std::abs(warp.fold_v[k]) +
                     std::abs(warp.twist[k]) + std::abs(warp.fan_u[k]) + std::abs(warp.fan_v[k]) +
                     std::abs(warp.rest[k]));
  };
  const float half_x = half(f.ax, f.bx, 0), half_y = half(f.ay, f.by, 1);
  const float x_last = static_cast<float>(width_px - 1), y_last = static_cast<float>(height_px - 1);
  if (f.x >= half_x && f.x <= x_last - half_x && f.y >= half_y && f.y <= y_last - half_y) return Inside::kAll;
  const bool some =
      f.x + half_x >= 0 && f.x - half_x <= x_last && f.y + half_y >= 0 && f.y - half_y <= y_last;
  return some ? Inside::kSome : Inside::kNone;
}

// 1 for samples in the image, 0 for others; returns how many are.
inline int MaskOutside(const CellPose& f, const CellWarp& warp, int width_px, int height_px,
                       SampleMask* mask) {
  const float x_last = static_cast<float>(width_px - 1), y_last = static_cast<float>(height_px - 1);
  int inside = 0;
  for (int k = 0; k < kSampleGroups * kSampleLanes; ++k) {
    const float u = CellSample(k % kCellSide), v = CellSample(k / kCellSide);
    const float x = f.x + u * f.ax + v * f.bx + warp.At(0, u, v);
    const float y = f.y + u * f.ay + v * f.by + warp.At(1, u, v);
    const bool in = x >= 0 && y >= 0 && x <= x_last && y <= y_last;
    mask->weights[k] = in ? 1.0f : 0.0f;
    inside += in;
  }
  return inside;
}

// 0 for samples of `cell` that lie on one of the others, 1 for the rest; returns how many samples on the cell
// itself (of 16) are left.
inline int MaskCovered(const CellPose& cell, std::span<const CellPose> others, SampleMask* mask) {
  int left = 0;
  for (int k = 0; k < kSampleGroups * kSampleLanes; ++k) {
    const float u = CellSample(k % kCellSide), v = CellSample(k / kCellSide);
    const float x = cell.x + u * cell.ax + v * cell.bx, y = cell.y + u * cell.ay + v * cell.by;
    const bool covered = std::any_of(others.begin(), others.end(), [x, y](const CellPose& other) {
      return other.Contains(x - other.x, y - other.y);
    });
    mask->weights[k] = covered ? 0.0f : 1.0f;
    left += !covered && std::abs(u) < 0.5f && std::abs(v) < 0.5f;
  }
  return left;
}

}  // namespace weft
