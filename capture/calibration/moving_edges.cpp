#include "capture/calibration/moving_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>

#include "capture/calibration/tag_detection.h"

namespace weft {
namespace {

constexpr int kReachPx = 16;         // of a profile to both sides of its edge
constexpr size_t kLeastEdges = 60;   // over all images
constexpr double kSmoothingPx2 = 1;  // variance of Smoothed's weights

using Plane = std::vector<float>;

// Weights 1 4 6 4 1 along both axes, against noise; two pixels at the border stay 0.
Plane Smoothed(const Frame& grey) {
  constexpr std::array<float, 5> kWeights = {1 / 16.f, 4 / 16.f, 6 / 16.f, 4 / 16.f, 1 / 16.f};
  const int width = grey.width_px, height = grey.height_px;
  Plane rows(grey.pixels->size(), 0.f), out(grey.pixels->size(), 0.f);
  for (int y = 0; y < height; ++y) {
    const uint8_t* from = grey.row(y);
    for (int x = 2; x < width - 2; ++x) {
      float sum = 0;
      for (int k = 0; k < 5; ++k) sum += kWeights[k] * from[x + k - 2];
      rows[static_cast<size_t>(y) * width + x] = sum;
    }
  }
  for (int y = 2; y < height - 2; ++y) {
    for (int x = 0; x < width; ++x) {
      float sum = 0;
      for (int k = 0; k < 5; ++k) sum += kWeights[k] * rows[static_cast<size_t>(y + k - 2) * width + x];
      out[static_cast<size_t>(y) * width + x] = sum;
    }
  }
  return out;
}

Plane MedianOf(const std::vector<Plane>& images) {
  Plane out(images[0].size());
  std::vector<float> values(images.size());
  for (size_t i = 0; i < out.size(); ++i) {
    for (size_t k = 0; k < images.size(); ++k) values[k] = images[k][i];
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    out[i] = *middle;
  }
  return out;
}

// The step along one axis through the pixel at `at`, `stride` apart: from there to both sides as long as the
// brightness goes on in the same direction.
struct Step {
  double height = 0, slope = 0;
};
Step StepAt(const float* at, std::ptrdiff_t stride) {
  Step out;
  out.slope = (at[stride] - at[-stride]) / 2.0;
  const float sign = out.slope < 0 ? -1.f : 1.f;
  int ahead = 0, behind = 0;
  while (ahead < kReachPx && sign * (at[(ahead + 1) * stride] - at[ahead * stride]) > 0) ++ahead;
  while (behind < kReachPx && sign * (at[-behind * stride] - at[-(behind + 1) * stride]) > 0) ++behind;
  out.height = sign * (at[ahead * stride] - at[-behind * stride]);
  out.slope *= sign;
  return out;
}

// Widths of the edges of `image` that are not in `still`. A step that was blurred by a normal distribution
// rises by its height over sqrt(2 pi) sigmas at its steepest.
void AddEdgeWidths(const Plane& image, const Plane& still, int width, int height, double min_contrast,
                   std::vector<double>* widths_px) {
  const int margin = kReachPx + 4;
  for (int y = margin; y < height - margin; ++y) {
    for (int x = margin; x < width - margin; ++x) {
      const size_t i = static_cast<size_t>(y) * width + x;
      if (std::abs(image[i] - still[i]) < min_contrast) continue;
      const float* at = &image[i];
      const float along = at[1] - at[-1], across = at[width] - at[-width];
      const bool upright = std::abs(along) >= std::abs(across);  // the edge; it is crossed along the row
      const std::ptrdiff_t stride = upright ? 1 : width;
      const float here = std::abs(upright ? along : across);
      // The steepest place of its profile only.
      if (here < 2 || here < std::abs(at[2 * stride] - at[0]) || here <= std::abs(at[0] - at[-2 * stride]))
        continue;
      const Step step = StepAt(at, stride);
      if (step.height < min_contrast) continue;
      // The profile runs along an axis, not along the gradient.
      const double slant = here / std::hypot(along, across);
      const double sigma = slant * step.height / (step.slope * std::sqrt(2 * M_PI));
      widths_px->push_back(std::sqrt(std::max(0.0, sigma * sigma - kSmoothingPx2)));
    }
  }
}

}  // namespace

absl::StatusOr<std::optional<double>> MovingEdgeBlurPx(const std::vector<Frame>& images,
                                                       double min_contrast) {
  if (images.size() < 3) return absl::InvalidArgumentError("moving edges need at least 3 images");
  std::vector<Plane> smooth;
  for (const Frame& image : images) {
    const absl::StatusOr<Frame> grey = Grey(image);
    if (!grey.ok()) return grey.status();
    if (grey->width_px != images[0].width_px || grey->height_px != images[0].height_px)
      return absl::InvalidArgumentError("images of a camera have different sizes");
    smooth.push_back(Smoothed(*grey));
  }
  const Plane still = MedianOf(smooth);
  std::vector<double> widths_px;
  for (const Plane& image : smooth)
    AddEdgeWidths(image, still, images[0].width_px, images[0].height_px, min_contrast, &widths_px);
  if (widths_px.size() < kLeastEdges) return std::nullopt;
  const auto middle = widths_px.begin() + static_cast<std::ptrdiff_t>(widths_px.size() / 2);
  std::nth_element(widths_px.begin(), middle, widths_px.end());
  return *middle;
}

}  // namespace weft
