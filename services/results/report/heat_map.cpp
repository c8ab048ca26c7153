#include "services/results/report/heat_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/median.h"
#include "capture/image/image_encoders.h"
#include "services/results/report/html_text.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/plot_axes.h"

namespace weft {
namespace {

constexpr size_t kMaxBins = 360;
constexpr double kWidth = 1120, kLeft = 96, kRight = 1112, kTop = 26;
constexpr double kAllRows = 800, kLeastRow = 3, kLargestRow = 18, kLabelStep = 13;
constexpr double kScaleShare = 0.98;

using Color = std::array<double, 3>;  // red, green, blue
constexpr Color kMissing = {196, 26, 34};

// 1, 2 or 5 times a power of ten, at least most of the values.
double ScaleOf(const std::vector<HeatMapRow>& rows) {
  std::vector<double> sizes;
  for (const HeatMapRow& row : rows)
    for (const double value : row.values)
      if (std::isfinite(value) && value != 0) sizes.push_back(std::abs(value));
  if (sizes.empty()) return 1;
  const double most = Quantile(std::move(sizes), kScaleShare),
               decade = std::pow(10, std::floor(std::log10(most)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (most <= factor * decade * (1 + 1e-9)) return factor * decade;
  return 10 * decade;
}

Color ColorOf(double value, double scale) {
  const Eigen::Vector3f blue_to_orange = DivergingColor(value / scale);
  Color color;
  for (size_t c = 0; c < 3; ++c) color[c] = 255.0 * blue_to_orange[static_cast<Eigen::Index>(c)];
  return color;
}

std::string Hex(const Color& color) {
  return absl::StrFormat("#%02x%02x%02x", std::lround(color[0]), std::lround(color[1]),
                         std::lround(color[2]));
}

struct Cell {
  double farthest = std::nan("");
  bool lacks = false;
};
Cell CellOf(const PlotBin& bin, const std::vector<double>& values) {
  Cell cell;
  for (size_t i = bin.begin; i < bin.end; ++i) {
    if (!std::isfinite(values[i])) {
      cell.lacks = true;
    } else if (!std::isfinite(cell.farthest) || std::abs(values[i]) > std::abs(cell.farthest)) {
      cell.farthest = values[i];
    }
  }
  return cell;
}

// A pixel per cell, blank ones transparent.
std::string Png(const std::vector<HeatMapRow>& rows, const std::vector<PlotBin>& bins, double scale,
                HeatMapGaps gaps) {
  std::vector<uint8_t> rgba(rows.size() * bins.size() * 4, 0);
  for (size_t y = 0; y < rows.size(); ++y) {
    for (size_t x = 0; x < bins.size(); ++x) {
      const Cell cell = CellOf(bins[x], rows[y].values);
      const bool is_fault = cell.lacks && gaps == HeatMapGaps::kAreFaults;
      if (!is_fault && !std::isfinite(cell.farthest)) continue;
      const Color color = is_fault ? kMissing : ColorOf(cell.farthest, scale);
      uint8_t* pixel = rgba.data() + 4 * (y * bins.size() + x);
      for (size_t c = 0; c < 3; ++c) pixel[c] = static_cast<uint8_t>(std::lround(color[c]));
      pixel[3] = 255;
    }
  }
  const auto png = EncodePng({static_cast<int>(bins.size()), static_cast<int>(rows.size()), 4, 8, rgba},
                             PngEffort::kSmall);
  return png.ok() ? Base64({reinterpret_cast<const char*>(png->data()), png->size()}) : "";
}

std::string Tick(double x, double y, const char* anchor, const std::string& text) {
  return absl::StrFormat("<text class=\"tick\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%s</text>", x, y,
                         anchor, EscapeHtml(Shortened(text, 16)));
}

std::string HeatLegend(double scale, const PlotText& text, HeatMapGaps gaps) {
  constexpr double kWide = 180, kX = kRight - kWide;
  const std::string unit = text.unit.empty() ? "" : "\xC2\xA0" + text.unit;
  std::string svg = absl::StrCat("<defs><linearGradient id=\"heat\">");
  for (int i = -4; i <= 4; ++i)
    absl::StrAppendFormat(&svg, "<stop offset=\"%.1f%%\" stop-color=\"%s\"/>", 12.5 * (i + 4),
                          Hex(ColorOf(i, 4)));
  absl::StrAppendFormat(&svg,
                        "</linearGradient></defs><rect x=\"%.0f\" y=\"2\" width=\"%.0f\" height=\"10\" "
                        "fill=\"url(#heat)\"/>",
                        kX, kWide);
  const std::string number = absl::StrFormat("%g", scale);
  svg += Tick(kX - 6, 11, "end", absl::StrCat("-", number, unit));
  absl::StrAppend(&svg, Tick(kX + kWide, 23, "end", absl::StrCat(number, unit)),
                  Tick(kX + kWide / 2, 23, "middle", "0"));
  if (gaps == HeatMapGaps::kAreBlank) return svg;
  absl::StrAppendFormat(&svg, "<rect x=\"%.0f\" y=\"2\" width=\"10\" height=\"10\" fill=\"%s\"/>", kLeft,
                        Hex(kMissing));
  return svg + Tick(kLeft + 15, 11, "start", "frame missing");
}

}  // namespace

std::string HeatMap(const PlotFrames& frames, const std::vector<HeatMapRow>& rows, const PlotText& text,
                    HeatMapGaps gaps) {
  const std::vector<PlotBin> bins = MakeBins(frames.names.size(), kMaxBins);
  if (bins.empty() || rows.empty()) return "";
  const double row_height = std::clamp(kAllRows / static_cast<double>(rows.size()), kLeastRow, kLargestRow);
  const double height = row_height * static_cast<double>(rows.size()), bottom = kTop + height;
  const double scale = ScaleOf(rows);
  std::string svg = HeatLegend(scale, text, gaps);
  absl::StrAppendFormat(
      &svg,
      "<image x=\"%.0f\" y=\"%.0f\" width=\"%.0f\" height=\"%.1f\" preserveAspectRatio=\"none\" "
      "style=\"image-rendering:pixelated\" href=\"data:image/png;base64,%s\"/>",
      kLeft, kTop, kRight - kLeft, height, Png(rows, bins, scale, gaps));
  const auto label_every = static_cast<size_t>(std::ceil(kLabelStep / row_height));
  for (size_t r = 0; r < rows.size(); ++r) {
    const double y = kTop + row_height * static_cast<double>(r);
    if (r % label_every == 0) svg += Tick(kLeft - 6, y + row_height / 2 + 4, "end", rows[r].name);
    absl::StrAppendFormat(
        &svg,
        "<rect x=\"0\" y=\"%.1f\" width=\"%.0f\" height=\"%.1f\" fill=\"transparent\"><title>%s%s"
        "</title></rect>",
        y, kRight, row_height, EscapeHtml(rows[r].name), EscapeHtml(rows[r].note));
  }
  svg += Tick(kLeft, bottom + 14, "start", absl::StrCat(frames.noun, " ", frames.names.front()));
  if (bins.size() > 4)
    svg += Tick((kLeft + kRight) / 2, bottom + 14, "middle", frames.names[frames.names.size() / 2]);
  svg += Tick(kRight, bottom + 14, "end", frames.names.back());
  return absl::StrFormat(
      "<figure class=\"heat\"><figcaption>%s</figcaption><svg viewBox=\"0 0 %.0f %.0f\" role=\"img\" "
      "aria-label=\"%s\">%s</svg></figure>\n",
      EscapeHtml(text.title), kWidth, bottom + 20, EscapeHtml(text.title), svg);
}

}  // namespace weft
