#include "pattern/keypoints.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "pattern/cell_kernel.h"

namespace weft {
namespace {

// Offset of the maximum of the parabola through three equidistant values, at most half a step.
float PeakOffset(float before, float here, float after) {
  const float curvature = before - 2 * here + after;
  if (curvature >= 0) return 0;
  return std::clamp(0.5f * (before - after) / curvature, -0.5f, 0.5f);
}

using Float4 = float __attribute__((vector_size(16)));

Float4 Min(Float4 a, Float4 b) { return a < b ? a : b; }

// Least of the 7x7 pixels around one; pixels beyond the border repeat it.
float DarkestNear(const Plane& plane, int x, int y) {
  if (x >= 3 && y >= 3 && x + 3 < plane.width_px && y + 3 < plane.height_px) {
    Float4 least = {1e9f, 1e9f, 1e9f, 1e9f}, left, right;
    for (int dy = -3; dy <= 3; ++dy) {
      const float* row = plane.row(y + dy) + x;
      std::memcpy(&left, row - 3, sizeof left);
      std::memcpy(&right, row, sizeof right);
      least = Min(least, Min(left, right));
    }
    return std::min(std::min(least[0], least[1]), std::min(least[2], least[3]));
  }
  float darkest = plane.row(y)[x];
  for (int dy = -3; dy <= 3; ++dy) {
    const float* row = plane.row(std::clamp(y + dy, 0, plane.height_px - 1));
    for (int dx = -3; dx <= 3; ++dx)
      darkest = std::min(darkest, row[std::clamp(x + dx, 0, plane.width_px - 1)]);
  }
  return darkest;
}

}  // namespace

absl::Status KeypointOptions::Validate() const {
  if (!(surround_px >= 0.6f && surround_px <= 20)) {
    return absl::InvalidArgumentError("keypoints.surround_px must lie in 0.6 to 20");
  }
  if (!(min_contrast >= 0)) return absl::InvalidArgumentError("keypoints.min_contrast must not be negative");
  return absl::OkStatus();
}

std::vector<Keypoint> DetectKeypoints(const Plane& spots, const KeypointOptions& options) {
  std::vector<Keypoint> points;
  std::vector<uint8_t> peaks((spots.width_px + 15) / 8 * 8, 0);
  for (int y = 1; y + 1 < spots.height_px; ++y) {
    const float* above = spots.row(y - 1);
    const float* here = spots.row(y);
    const float* below = spots.row(y + 1);
    BestCellKernels().mark_peaks(above, here, below, 0, spots.width_px, peaks.data());
    for (int x = 1; x + 1 < spots.width_px; ++x) {
      if (x % 8 == 0) {
        uint64_t eight;
        std::memcpy(&eight, &peaks[x], sizeof eight);
        if (eight == 0) {
          x += 7;
          continue;
        }
      }
      if (peaks[x] == 0) continue;
      if (here[x] - DarkestNear(spots, x, y) < options.min_contrast) continue;
      points.push_back({static_cast<float>(x) + PeakOffset(here[x - 1], here[x], here[x + 1]),
                        static_cast<float>(y) + PeakOffset(above[x], here[x], below[x]), here[x]});
    }
  }
  return points;
}

KeypointGrid::KeypointGrid(const std::vector<Keypoint>& points, int width_px, int height_px)
    : points_(points), columns_(width_px / kBucketPx + 1), rows_(height_px / kBucketPx + 1) {
  first_.assign(static_cast<size_t>(columns_) * rows_ + 1, 0);
  std::vector<int> bucket(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    bucket[i] = Bucket(points[i].y_px, rows_) * columns_ + Bucket(points[i].x_px, columns_);
    ++first_[bucket[i] + 1];
  }
  for (size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
  indices_.resize(points.size());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (size_t i = 0; i < points.size(); ++i) indices_[next[bucket[i]]++] = static_cast<int>(i);
}

}  // namespace weft
