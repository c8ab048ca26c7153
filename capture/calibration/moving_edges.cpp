#include "capture/calibration/moving_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "base/median.h"
#include "base/status_macros.h"
#include "capture/calibration/tag_detection.h"

namespace weft {
namespace {

constexpr int kReachPx = 16;         // of a profile to both sides of its edge
constexpr size_t kLeastEdges = 60;   // over all images
constexpr double kSmoothingPx2 = 1;  // variance of Smoothed's weights

cv::Mat Wrapped(const Frame& grey) {  // the pixels are only read
  return cv::Mat(grey.height_px, grey.width_px, CV_8U, const_cast<uint8_t*>(grey.pixels->data()));
}

// Weights 1 4 6 4 1 along both axes, against noise.
cv::Mat1f Smoothed(const cv::Mat& grey) {
  const cv::Matx<float, 1, 5> weights(1 / 16.f, 4 / 16.f, 6 / 16.f, 4 / 16.f, 1 / 16.f);
  cv::Mat1f out;
  cv::sepFilter2D(grey, out, CV_32F, weights, weights);
  return out;
}

cv::Mat MedianOf(const std::vector<Frame>& greys) {
  cv::Mat out(greys[0].height_px, greys[0].width_px, CV_8U);
  std::vector<uint8_t> values(greys.size());
  for (size_t i = 0; i < greys[0].pixels->size(); ++i) {
    for (size_t k = 0; k < greys.size(); ++k) values[k] = (*greys[k].pixels)[i];
    out.data[i] = ValueAtRank(values, values.size() / 2);
  }
  return out;
}

// The step along one axis through the pixel at `at`, `stride` apart: from there to both sides as long as the
// brightness goes on in the same direction.
struct IntensityStep {
  double height = 0, slope = 0;
};
IntensityStep StepAt(const float* at, std::ptrdiff_t stride) {
  IntensityStep out;
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
void AddEdgeWidths(const cv::Mat1f& image, const cv::Mat1f& still, double min_contrast,
                   std::vector<double>* widths_px) {
  const int margin = kReachPx + 4, width = image.cols, height = image.rows;
  for (int y = margin; y < height - margin; ++y) {
    for (int x = margin; x < width - margin; ++x) {
      if (std::abs(image(y, x) - still(y, x)) < min_contrast) continue;
      const float* at = &image(y, x);
      const float along = at[1] - at[-1], across = at[width] - at[-width];
      const bool upright = std::abs(along) >= std::abs(across);  // the edge; it is crossed along the row
      const std::ptrdiff_t stride = upright ? 1 : width;
      const float here = std::abs(upright ? along : across);
      // The steepest place of its profile only.
      if (here < 2 || here < std::abs(at[2 * stride] - at[0]) || here <= std::abs(at[0] - at[-2 * stride]))
        continue;
      const IntensityStep step = StepAt(at, stride);
      if (step.height < min_contrast) continue;
      // The profile runs along an axis, not along the gradient.
      const double slant = here / std::hypot(along, across);
      const double sigma = slant * step.height / (step.slope * std::sqrt(2 * M_PI));
      // The slope is a mean over two pixels of that axis, whose variance is a third.
      widths_px->push_back(std::sqrt(std::max(0.0, sigma * sigma - kSmoothingPx2 - slant * slant / 3)));
    }
  }
}

}  // namespace

absl::StatusOr<std::optional<double>> MovingEdgeBlurPx(const std::vector<Frame>& images,
                                                       double min_contrast) {
  if (images.size() < 3) return absl::InvalidArgumentError("moving edges need at least 3 images");
  std::vector<Frame> greys;
  for (const Frame& image : images) {
    WEFT_ASSIGN_OR_RETURN(Frame grey, Grey(image));
    if (grey.width_px != images[0].width_px || grey.height_px != images[0].height_px)
      return absl::InvalidArgumentError("images of a camera have different sizes");
    greys.push_back(std::move(grey));
  }
  const cv::Mat1f still = Smoothed(MedianOf(greys));
  std::vector<double> widths_px;
  for (const Frame& grey : greys) AddEdgeWidths(Smoothed(Wrapped(grey)), still, min_contrast, &widths_px);
  if (widths_px.size() < kLeastEdges) return std::nullopt;
  return Median(std::move(widths_px));
}

}  // namespace weft
