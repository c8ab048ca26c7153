#include "services/results/report/plot_axes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"

namespace weft {
namespace {

std::string AxisLabel(double x, absl::string_view anchor, const std::string& name) {
  return absl::StrFormat("<text class=\"tick\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%s</text>", x,
                         PlotArea::kBottom + 16, anchor, EscapeHtml(Shortened(name, 14)));
}

}  // namespace

std::vector<PlotBin> MakeBins(size_t frames, size_t max_bins) {
  const size_t size = std::max<size_t>(1, (frames + max_bins - 1) / max_bins);
  std::vector<PlotBin> bins;
  for (size_t begin = 0; begin < frames; begin += size)
    bins.push_back({begin, std::min(begin + size, frames)});
  return bins;
}

BinValues ValuesIn(const PlotBin& bin, const std::vector<double>& values) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  BinValues result{0, kNone, kNone};
  int count = 0;
  for (size_t i = bin.begin; i < bin.end; ++i) {
    if (!std::isfinite(values[i])) continue;
    result.mean += values[i];
    result.low = count == 0 ? values[i] : std::min(result.low, values[i]);
    result.high = count == 0 ? values[i] : std::max(result.high, values[i]);
    ++count;
  }
  result.mean = count > 0 ? result.mean / count : kNone;
  return result;
}

std::vector<double> RoundTicks(double low, double high) {
  if (!(high > low)) high = low + (low != 0 ? std::abs(low) : 1);
  const double rough = (high - low) / 4;
  const double decade = std::pow(10, std::floor(std::log10(rough)));
  double step = 10 * decade;
  for (const double factor : {1.0, 2.0, 2.5, 5.0}) {
    if (rough <= factor * decade * (1 + 1e-9)) {
      step = factor * decade;
      break;
    }
  }
  const double first = std::floor(low / step + 1e-9), last = std::ceil(high / step - 1e-9);
  std::vector<double> ticks;
  for (double k = first; k <= last + 0.5; ++k) ticks.push_back(k * step);
  return ticks;
}

std::string ValueText(double value, const PlotText& text) {
  if (text.unit == "%") return FormatPercent(value);
  const std::string number =
      text.decimals == 0 ? FormatCount(std::llround(value)) : FormatNumber(value, text.decimals);
  return text.unit.empty() ? number : absl::StrCat(number, "\xC2\xA0", text.unit);
}

std::vector<std::string> TickLabels(const std::vector<double>& ticks, const PlotText& text) {
  std::vector<std::string> labels;
  const double step = ticks[1] - ticks[0];
  const double shown_step = text.unit == "%" ? 100 * step : step;
  int decimals = 0;
  for (double s = shown_step; decimals < 6 && std::abs(s - std::round(s)) > 1e-6 * s; s *= 10) ++decimals;
  for (const double tick : ticks) {
    if (text.unit == "%") {
      labels.push_back(FormatNumber(100 * tick, decimals) + "\xC2\xA0%");
    } else if (decimals == 0) {
      labels.push_back(FormatCount(std::llround(tick)));
    } else {
      labels.push_back(FormatNumber(tick, decimals));
    }
  }
  return labels;
}

std::vector<double> ValueTicks(const std::vector<BinValues>& bins, const PlotText& text) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const BinValues& bin : bins) {
    if (!std::isfinite(bin.mean)) continue;
    low = std::min(low, bin.low);
    high = std::max(high, bin.high);
  }
  if (low > high) low = 0, high = 1;
  if (text.unit == "%" && text.whole_percent) {
    return RoundTicks(text.from_zero ? 0 : std::clamp(std::floor(10 * low - 0.5) / 10, 0.0, 0.9), 1);
  }
  return RoundTicks(text.from_zero ? std::min(0.0, low) : low, high);
}

bool HasValue(const std::vector<BinValues>& values, size_t bin) {
  return bin < values.size() && std::isfinite(values[bin].mean);
}

bool IsAlone(const std::vector<BinValues>& values, size_t bin) {
  return HasValue(values, bin) && !HasValue(values, bin + 1) && (bin == 0 || !HasValue(values, bin - 1));
}

double PlotArea::y(double value) const {
  const double share = (value - ticks_.front()) / (ticks_.back() - ticks_.front());
  return kBottom - std::clamp(share, 0.0, 1.0) * (kBottom - kTop);
}

std::string PlotArea::Path(const std::vector<BinValues>& bins) const {
  std::string path;
  bool drawing = false;
  for (size_t b = 0; b < bins.size(); ++b) {
    const bool has_value = std::isfinite(bins[b].mean);
    if (has_value) absl::StrAppendFormat(&path, "%c%.1f %.1f", drawing ? 'L' : 'M', x(b), y(bins[b].mean));
    drawing = has_value;
  }
  return path;
}

std::string PlotArea::Axes(const PlotFrames& frames, const std::vector<PlotBin>& bins,
                           const std::vector<std::string>& tick_labels) const {
  std::string svg;
  for (size_t i = 0; i < ticks_.size(); ++i) {
    absl::StrAppendFormat(&svg, "<line class=\"grid\" x1=\"%.0f\" x2=\"%.0f\" y1=\"%.1f\" y2=\"%.1f\"/>",
                          kLeft, kRight, y(ticks_[i]), y(ticks_[i]));
    absl::StrAppendFormat(&svg, "<text class=\"tick\" x=\"%.0f\" y=\"%.1f\" text-anchor=\"end\">%s</text>",
                          kLeft - 6, y(ticks_[i]) + 3.5, tick_labels[i]);
  }
  const std::vector<std::string>& names = frames.names;
  if (names.size() == 1) {
    svg += AxisLabel(x(0), "middle", names[0]);
  } else if (!names.empty()) {
    svg += AxisLabel(kLeft, "start", names.front());
    if (bins.size() > 4) svg += AxisLabel(x(bins.size() / 2), "middle", names[bins[bins.size() / 2].begin]);
    svg += AxisLabel(kRight, "end", names.back());
  }
  return svg;
}

std::string PlotArea::LostMarks(const PlotFrames& frames, const std::vector<PlotBin>& bins) const {
  std::string svg;
  for (size_t b = 0; b < bins.size(); ++b) {
    const auto begin = frames.without_mesh.begin();
    const auto lost = std::count(begin + static_cast<std::ptrdiff_t>(bins[b].begin),
                                 begin + static_cast<std::ptrdiff_t>(bins[b].end), true);
    if (lost == 0) continue;
    const std::string what =
        bins[b].end - bins[b].begin == 1 ? ": no mesh" : absl::StrCat(": ", lost, " without mesh");
    absl::StrAppendFormat(&svg, "<path class=\"lost\" d=\"M%.1f %.1fl4 7h-8z\"><title>%s%s</title></path>",
                          x(b), kBottom - 7, EscapeHtml(BinName(bins[b], frames)), what);
  }
  return svg;
}

std::string BinName(const PlotBin& bin, const PlotFrames& frames) {
  const std::vector<std::string>& names = frames.names;
  if (bin.end - bin.begin == 1) return absl::StrCat(frames.noun, " ", names[bin.begin]);
  return absl::StrCat(frames.noun, "s ", names[bin.begin], " to ", names[bin.end - 1]);
}

std::string PlotFigure(const PlotText& text, const std::string& legend, const std::string& body) {
  return absl::StrFormat(
      "<figure class=\"plot\"><figcaption>%s</figcaption>%s<svg viewBox=\"0 0 %.0f %.0f\" role=\"img\" "
      "aria-label=\"%s\">%s</svg></figure>\n",
      EscapeHtml(text.title), legend, PlotArea::kWidth, PlotArea::kHeight, EscapeHtml(text.title), body);
}

}  // namespace weft
