#include "services/tools/cli/decode_overlay.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kLeastPitchPx = 9.5;  // smaller cells are enlarged
constexpr int kMostScale = 4;
constexpr double kMostPixels = 48e6;  // of the picture
constexpr double kFontScale = 0.35, kLegendFontScale = 0.45;
constexpr int kLegendLinePx = 18;
const cv::Scalar kTextBack(0, 0, 0), kText(255, 235, 210), kCorner(255, 255, 255), kLoose(190, 190, 190);
// In the order of WhyMissing.
const cv::Scalar kWhyColors[kWhyMissing] = {{0, 170, 0},   {0, 220, 255}, {40, 80, 255}, {255, 0, 255},
                                            {255, 0, 0},   {255, 150, 0}, {255, 255, 0}, {120, 120, 0},
                                            {0, 120, 120}, {120, 0, 120}};

// One line of the legend, in the order in which things are drawn.
struct LegendEntry {
  cv::Scalar color;
  std::string text;
};

// Colours that are told apart, one for every number.
cv::Scalar Distinct(int number, double light) {
  constexpr double kGoldenAngle = 137.508;
  const double hue = std::fmod(number * kGoldenAngle, 360.0) / 60;
  const double x = 1 - std::abs(std::fmod(hue, 2.0) - 1);
  const double rgb[6][3] = {{1, x, 0}, {x, 1, 0}, {0, 1, x}, {0, x, 1}, {x, 0, 1}, {1, 0, x}};
  const double* c = rgb[static_cast<int>(hue) % 6];
  return {255 * (light + (1 - light) * c[0]), 255 * (light + (1 - light) * c[1]),
          255 * (light + (1 - light) * c[2])};
}

// Median distance of cells that are neighbours in a row of the board; 0 where there are none.
double MedianPitchPx(const std::vector<Observation>& observations) {
  std::vector<double> pitches;
  for (size_t i = 1; i < observations.size(); ++i) {
    const Observation &a = observations[i - 1], &b = observations[i];
    if (a.node.kind != NodeKind::kCenter || b.node.kind != NodeKind::kCenter) continue;
    if (a.node.row != b.node.row || a.node.col + 1 != b.node.col) continue;
    pitches.push_back(std::hypot(a.x_px - b.x_px, a.y_px - b.y_px));
  }
  return Median(std::move(pitches));
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

// Pixel centres stay at the centres of the enlarged pixels.
cv::Point At(double x_px, double y_px, int scale) {
  return {cvRound((x_px + 0.5) * scale - 0.5), cvRound((y_px + 0.5) * scale - 0.5)};
}

// Cells in the colour of their patch, corners as white points.
void DrawNodes(const DecodeResult& result, int scale, double pitch_px, cv::Mat& picture,
               std::vector<LegendEntry>& legend) {
  const int radius = std::clamp(cvRound(0.18 * pitch_px * scale), 1, 6);
  const std::vector<int>& groups = result.explanation.groups;
  size_t cells = 0;
  std::map<int, int> numbers;  // of the groups, as they appear
  for (const Observation& o : result.observations) {
    const cv::Point at = At(o.x_px, o.y_px, scale);
    if (o.node.kind == NodeKind::kCorner) {
      cv::circle(picture, at, std::max(0, radius - 2), kCorner, cv::FILLED);
      continue;
    }
    const int group = cells < groups.size() ? groups[cells] : 0;
    ++cells;
    const int number = numbers.emplace(group, static_cast<int>(numbers.size())).first->second;
    cv::circle(picture, at, radius + 1, kTextBack, cv::FILLED);
    cv::circle(picture, at, radius, Distinct(number, 0.25), cv::FILLED);
  }
  legend.push_back({Distinct(0, 0.25), absl::StrCat(cells, " cells, a colour for each of ", numbers.size(),
                                                    " patches that they grew from; corners white")});
}

// Places of the image that are near a decoded cell.
class DecodedPlaces {
 public:
  DecodedPlaces(const Frame& frame, const std::vector<Observation>& observations, double pitch_px)
      : bucket_px_(std::max(pitch_px, 4.0)),
        columns_(static_cast<int>(frame.width_px / bucket_px_) + 1),
        rows_(static_cast<int>(frame.height_px / bucket_px_) + 1),
        taken_(static_cast<size_t>(columns_) * rows_, false) {
    for (const Observation& o : observations) taken_[Bucket(o.x_px, o.y_px)] = true;
  }
  bool Near(double x_px, double y_px) const {
    for (const double dx : {-bucket_px_, 0.0, bucket_px_}) {
      for (const double dy : {-bucket_px_, 0.0, bucket_px_}) {
        if (taken_[Bucket(x_px + dx, y_px + dy)]) return true;
      }
    }
    return false;
  }

 private:
  size_t Bucket(double x, double y) const {
    const int col = std::clamp(static_cast<int>(x / bucket_px_), 0, columns_ - 1);
    const int row = std::clamp(static_cast<int>(y / bucket_px_), 0, rows_ - 1);
    return static_cast<size_t>(row) * columns_ + col;
  }

  double bucket_px_;
  int columns_, rows_;
  std::vector<bool> taken_;
};

// Spots that were joined to nothing, away from decoded cells.
void DrawLoose(const Frame& frame, const DecodeResult& result, int scale, double pitch_px, cv::Mat& picture,
               std::vector<LegendEntry>& legend) {
  const DecodedPlaces decoded(frame, result.observations, pitch_px);
  int count = 0;
  for (const LooseBlob& spot : result.explanation.loose) {
    if (decoded.Near(spot.x_px, spot.y_px)) continue;
    cv::circle(picture, At(spot.x_px, spot.y_px, scale), 1, kLoose, cv::FILLED);
    ++count;
  }
  legend.push_back({kLoose, absl::StrCat(count, " bright blobs that belong to no patch")});
}

// A cross where growth stopped, a colour for each reason.
void DrawMissing(const DecodeResult& result, int scale, double pitch_px, cv::Mat& picture,
                 std::vector<LegendEntry>& legend) {
  const int arm = std::clamp(cvRound(0.25 * pitch_px * scale), 2, 6);
  int counts[kWhyMissing] = {};
  for (const MissingCell& cell : result.explanation.missing) {
    const int why = static_cast<int>(cell.why);
    ++counts[why];
    const cv::Point at = At(cell.x_px, cell.y_px, scale);
    cv::drawMarker(picture, at, kTextBack, cv::MARKER_TILTED_CROSS, 2 * arm, 3);
    cv::drawMarker(picture, at, kWhyColors[why], cv::MARKER_TILTED_CROSS, 2 * arm, 1);
  }
  for (int why = 0; why < kWhyMissing; ++why) {
    if (counts[why] == 0) continue;
    legend.push_back({kWhyColors[why], absl::StrCat(counts[why], " cells not taken: ",
                                                    std::string(Describe(static_cast<WhyMissing>(why))))});
  }
}

cv::Rect LabelPlace(const std::string& text, cv::Point at, const cv::Mat& picture) {
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kFontScale, 1, &baseline);
  const int width = size.width + 2, height = size.height + baseline + 1;
  return {std::clamp(at.x, 0, std::max(0, picture.cols - width)),
          std::clamp(at.y - height, 0, std::max(0, picture.rows - height)), width, height};
}

void DrawLabel(const std::string& text, const cv::Rect& place, cv::Mat& picture) {
  cv::rectangle(picture, place, kTextBack, cv::FILLED);
  cv::putText(picture, text, {place.x + 1, place.y + place.height - 4}, cv::FONT_HERSHEY_SIMPLEX, kFontScale,
              kText, 1, cv::LINE_AA);
}

// A box around each rejected patch, a colour for each reason; the large ones are labelled where there is
// room.
void DrawRejected(const std::vector<PatchReport>& patches, int scale, cv::Mat& picture,
                  std::vector<LegendEntry>& legend) {
  std::vector<const PatchReport*> rejected;
  std::map<std::string, int> counts;
  for (const PatchReport& patch : patches) {
    if (patch.accepted) continue;
    rejected.push_back(&patch);
    ++counts[patch.reason];
  }
  std::map<std::string, cv::Scalar> colors;
  for (const auto& [reason, count] : counts) {
    const cv::Scalar color = Distinct(2 * static_cast<int>(colors.size()), 0.5);
    colors[reason] = color;
    legend.push_back({color, absl::StrCat(count, " patches rejected (boxes, with their blobs): ", reason)});
  }
  std::ranges::stable_sort(rejected,
                           [](const PatchReport* a, const PatchReport* b) { return a->nodes > b->nodes; });
  std::vector<cv::Rect> labels;
  for (const PatchReport* patch : rejected) {
    const cv::Point low = At(patch->x_min_px, patch->y_min_px, scale) - cv::Point(2, 2);
    const cv::Point high = At(patch->x_max_px, patch->y_max_px, scale) + cv::Point(2, 2);
    cv::rectangle(picture, low, high, colors[patch->reason], 1);
    const std::string text = absl::StrCat(patch->reason, " (", patch->nodes, ")");
    const cv::Rect place = LabelPlace(text, low, picture);
    const bool covers =
        std::ranges::any_of(labels, [&](const cv::Rect& other) { return (other & place).area() > 0; });
    if (covers) continue;
    labels.push_back(place);
    DrawLabel(text, place, picture);
  }
}

// The picture with the legend below.
cv::Mat WithLegend(const cv::Mat& picture, const std::vector<LegendEntry>& legend) {
  const int height = static_cast<int>(legend.size()) * kLegendLinePx + 8;
  cv::Mat out(picture.rows + height, picture.cols, CV_8UC3, cv::Scalar(24, 24, 24));
  picture.copyTo(out(cv::Rect(0, 0, picture.cols, picture.rows)));
  for (size_t k = 0; k < legend.size(); ++k) {
    const int y = picture.rows + 4 + static_cast<int>(k) * kLegendLinePx;
    cv::rectangle(out, {6, y + 4, 10, 10}, legend[k].color, cv::FILLED);
    cv::putText(out, legend[k].text, {22, y + 13}, cv::FONT_HERSHEY_SIMPLEX, kLegendFontScale, kText, 1,
                cv::LINE_AA);
  }
  return out;
}

}  // namespace

absl::StatusOr<Frame> DrawDecoding(const Frame& frame, const DecodeResult& result) {
  WEFT_ASSIGN_OR_RETURN(const Frame rgb, ToRgb(frame));
  const cv::Mat image(rgb.height_px, rgb.width_px, CV_8UC3, const_cast<uint8_t*>(rgb.pixels->data()));
  const double pitch_px = MedianPitchPx(result.observations);
  const int scale = ScaleFor(rgb, pitch_px);
  cv::Mat picture;
  cv::resize(image, picture, {}, scale, scale, cv::INTER_LINEAR);
  std::vector<LegendEntry> legend;
  DrawNodes(result, scale, pitch_px, picture, legend);
  DrawLoose(rgb, result, scale, pitch_px, picture, legend);
  DrawMissing(result, scale, pitch_px, picture, legend);
  DrawRejected(result.patches, scale, picture, legend);
  picture = WithLegend(picture, legend);

  Frame out;
  out.width_px = picture.cols;
  out.height_px = picture.rows;
  out.format = PixelFormat::kRgb8;
  out.pixels = std::make_shared<const std::vector<uint8_t>>(
      picture.data, picture.data + picture.total() * picture.elemSize());
  return out;
}

}  // namespace weft
