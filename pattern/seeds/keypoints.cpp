#include "pattern/seeds/keypoints.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "pattern/image/image_kernel.h"

namespace weft {
namespace {

// Offset of the maximum of the parabola through three equidistant values, at most half a step.
float PeakOffset(float before, float here, float after) {
  const float curvature = before - 2 * here + after;
  if (curvature >= 0) return 0;
  return std::clamp(0.5f * (before - after) / curvature, -0.5f, 0.5f);
}

}  // namespace

absl::Status KeypointOptions::Validate() const {
  if (!(min_contrast >= 0)) return absl::InvalidArgumentError("keypoints.min_contrast must not be negative");
  return absl::OkStatus();
}

std::vector<Keypoint> DetectKeypoints(const Plane& spots, const KeypointOptions& options) {
  std::vector<Keypoint> points;
  std::vector<float> scratch(spots.width_px + 6);
  // Most pixels are none, so many are looked at together.
  constexpr int kTogether = 32;
  std::vector<uint8_t> peaks((spots.width_px / kTogether + 1) * kTogether, 0);
  for (int y = 1; y + 1 < spots.height_px; ++y) {
    const float* rows[7];
    for (int k = 0; k < 7; ++k) rows[k] = spots.row(std::clamp(y + k - 3, 0, spots.height_px - 1));
    const float *above = rows[2], *here = rows[3], *below = rows[4];
    BestImageKernels().peak_row(rows, options.min_contrast, spots.width_px, scratch.data(), peaks.data());
    for (int first = 0; first + 1 < spots.width_px; first += kTogether) {
      uint64_t eights[kTogether / 8];
      std::memcpy(eights, &peaks[first], sizeof eights);
      if ((eights[0] | eights[1] | eights[2] | eights[3]) == 0) continue;
      for (int x = first; x < first + kTogether; ++x) {
        if (peaks[x] == 0) continue;
        points.push_back({static_cast<float>(x) + PeakOffset(here[x - 1], here[x], here[x + 1]),
                          static_cast<float>(y) + PeakOffset(above[x], here[x], below[x]), here[x]});
      }
    }
  }
  return points;
}

KeypointGrid::KeypointGrid(const std::vector<Keypoint>& points, int width_px, int height_px)
    : columns_(width_px / kBucketPx + 1), rows_(height_px / kBucketPx + 1) {
  first_.assign(static_cast<size_t>(columns_) * rows_ + 1, 0);
  std::vector<int> bucket(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    bucket[i] = Bucket(points[i].y_px, rows_) * columns_ + Bucket(points[i].x_px, columns_);
    ++first_[bucket[i] + 1];
  }
  for (size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
  places_.resize(points.size());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (size_t i = 0; i < points.size(); ++i) {
    places_[next[bucket[i]]++] = {points[i].x_px, points[i].y_px, static_cast<int>(i)};
  }
}

}  // namespace weft
