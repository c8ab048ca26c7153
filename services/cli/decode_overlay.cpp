#include "services/cli/decode_overlay.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr double kLeastPitchPx = 10;  // cells are enlarged to this
constexpr int kMostScale = 4;
constexpr double kMostPixels = 48e6;  // of the picture
constexpr double kFontScale = 0.35;
const cv::Scalar kBox(255, 90, 0), kTextBack(0, 0, 0), kText(255, 220, 160), kCorner(255, 255, 255);

// Median distance of cells that are neighbours in a row of the board; 0 where there are none.
double MedianPitchPx(const std::vector<Observation>& observations) {
  std::vector<double> pitches;
  for (size_t i = 1; i < observations.size(); ++i) {
    const Observation &a = observations[i - 1], &b = observations[i];
    if (a.node.kind != NodeKind::kCenter || b.node.kind != NodeKind::kCenter) continue;
    if (a.node.row != b.node.row || a.node.col + 1 != b.node.col) continue;
    pitches.push_back(std::hypot(a.x_px - b.x_px, a.y_px - b.y_px));
  }
  if (pitches.empty()) return 0;
  const auto middle = pitches.begin() + static_cast<std::ptrdiff_t>(pitches.size() / 2);
  std::nth_element(pitches.begin(), middle, pitches.end());
  return *middle;
}

int ScaleFor(const Frame& frame, double pitch_px) {
  int scale = 1;
  const double pixels = static_cast<double>(frame.width_px) * frame.height_px;
  while (pitch_px > 0 && pitch_px * scale < kLeastPitchPx && scale < kMostScale &&
         pixels * (scale + 1) * (scale + 1) <= kMostPixels) {
    ++scale;
  }
  return scale;
}

cv::Scalar ConfidenceColor(float confidence) {
  const double c = std::clamp(static_cast<double>(confidence), 0.0, 1.0);
  return {255 * std::min(1.0, 2 - 2 * c), 255 * std::min(1.0, 2 * c), 0};
}

// Pixel centres stay at the centres of the enlarged pixels.
cv::Point At(double x_px, double y_px, int scale) {
  return {cvRound((x_px + 0.5) * scale - 0.5), cvRound((y_px + 0.5) * scale - 0.5)};
}

void DrawNodes(const std::vector<Observation>& observations, int scale, double pitch_px, cv::Mat& picture) {
  const int radius = std::clamp(cvRound(0.18 * pitch_px * scale), 1, 6);
  for (const Observation& o : observations) {
    const cv::Point at = At(o.x_px, o.y_px, scale);
    if (o.node.kind == NodeKind::kCorner) {
      cv::circle(picture, at, std::max(0, radius - 2), kCorner, cv::FILLED);
      continue;
    }
    cv::circle(picture, at, radius + 1, kTextBack, cv::FILLED);
    cv::circle(picture, at, radius, ConfidenceColor(o.confidence), cv::FILLED);
  }
}

void DrawLabel(const std::string& text, cv::Point at, cv::Mat& picture) {
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kFontScale, 1, &baseline);
  at.x = std::clamp(at.x, 0, std::max(0, picture.cols - size.width - 2));
  at.y = std::clamp(at.y, size.height + 2, std::max(size.height + 2, picture.rows - baseline));
  cv::rectangle(picture, {at.x, at.y - size.height - 2}, {at.x + size.width + 1, at.y + baseline - 1},
                kTextBack, cv::FILLED);
  cv::putText(picture, text, {at.x + 1, at.y - 1}, cv::FONT_HERSHEY_SIMPLEX, kFontScale, kText, 1,
              cv::LINE_AA);
}

void DrawRejected(const std::vector<PatchReport>& patches, int scale, cv::Mat& picture) {
  std::vector<const PatchReport*> rejected;
  for (const PatchReport& patch : patches) {
    if (!patch.accepted) rejected.push_back(&patch);
  }
  std::stable_sort(rejected.begin(), rejected.end(),
                   [](const PatchReport* a, const PatchReport* b) { return a->nodes > b->nodes; });
  for (const PatchReport* patch : rejected) {
    const cv::Point low = At(patch->x_min_px, patch->y_min_px, scale) - cv::Point(2, 2);
    const cv::Point high = At(patch->x_max_px, patch->y_max_px, scale) + cv::Point(2, 2);
    cv::rectangle(picture, low, high, kBox, 1);
    DrawLabel(absl::StrCat(patch->reason, " (", patch->nodes, ")"), low, picture);
  }
}

}  // namespace

absl::StatusOr<Frame> DrawDecoding(const Frame& frame, const DecodeResult& result) {
  const absl::StatusOr<Frame> rgb = ToRgb(frame);
  if (!rgb.ok()) return rgb.status();
  const cv::Mat image(rgb->height_px, rgb->width_px, CV_8UC3, const_cast<uint8_t*>(rgb->pixels->data()));
  const double pitch_px = MedianPitchPx(result.observations);
  const int scale = ScaleFor(*rgb, pitch_px);
  cv::Mat picture;
  cv::resize(image, picture, {}, scale, scale, cv::INTER_LINEAR);
  DrawNodes(result.observations, scale, pitch_px, picture);
  DrawRejected(result.patches, scale, picture);

  Frame out;
  out.width_px = picture.cols;
  out.height_px = picture.rows;
  out.format = PixelFormat::kRgb8;
  out.pixels = std::make_shared<const std::vector<uint8_t>>(
      picture.data, picture.data + picture.total() * picture.elemSize());
  return out;
}

}  // namespace weft
