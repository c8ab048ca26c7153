#include "services/results/report/overlaid_plot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"
#include "services/results/report/svg_file.h"

namespace weft {
namespace {

constexpr size_t kMostOverlaidBins = 120;
constexpr double kWidth = 560, kHeight = 220, kLeft = 62, kRight = 548, kTop = 14, kBottom = 186;

// Consecutive frames that are drawn as one: [begin, end).
struct PlotBin {
  size_t begin = 0, end = 0;
};

// At most kMostOverlaidBins of equal size (the last may be smaller); no bin is empty.
std::vector<PlotBin> MakeBins(size_t frames) {
  const size_t size = std::max<size_t>(1, (frames + kMostOverlaidBins - 1) / kMostOverlaidBins);
  std::vector<PlotBin> bins;
  for (size_t begin = 0; begin < frames; begin += size)
    bins.push_back({begin, std::min(begin + size, frames)});
  return bins;
}

// Of the finite values of each bin; NaN where there are none.
std::vector<double> MeansOf(const std::vector<PlotBin>& bins, const std::vector<double>& values) {
  std::vector<double> means;
  for (const PlotBin& bin : bins) {
    double sum = 0, count = 0;
    for (size_t i = bin.begin; i < bin.end; ++i)
      if (std::isfinite(values[i])) sum += values[i], ++count;
    means.push_back(count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN());
  }
  return means;
}

bool HasValue(const std::vector<double>& means, size_t bin) {
  return bin < means.size() && std::isfinite(means[bin]);
}
// Where no line leads to a value, as in measures of a sample of the frames.
bool IsAlone(const std::vector<double>& means, size_t bin) {
  return HasValue(means, bin) && !HasValue(means, bin + 1) && (bin == 0 || !HasValue(means, bin - 1));
}

// Round numbers from at most `low` to at least `high`, three to seven of them.
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

// "0.142 mm", "95.2 %".
std::string ValueText(double value, const PlotText& text) {
  if (text.unit == "%") return FormatPercent(value);
  const std::string number =
      text.decimals == 0 ? FormatCount(std::llround(value)) : FormatNumber(value, text.decimals);
  return text.unit.empty() ? number : absl::StrCat(number, "\xC2\xA0", text.unit);
}

// One per tick, with as many decimals as they need.
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

// Ticks that hold the values; whole percentages end at 100.
std::vector<double> ValueTicks(const std::vector<std::vector<double>>& means, const PlotText& text) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const std::vector<double>& series : means)
    for (const double mean : series)
      if (std::isfinite(mean)) low = std::min(low, mean), high = std::max(high, mean);
  if (low > high) low = 0, high = 1;
  if (text.unit == "%" && text.whole_percent)
    return RoundTicks(text.from_zero ? 0 : std::clamp(std::floor(10 * low - 0.5) / 10, 0.0, 0.9), 1);
  return RoundTicks(text.from_zero ? std::min(0.0, low) : low, high);
}

// Where things are in the picture, in its units.
struct PlotArea {
  size_t bins;
  std::vector<double> ticks;

  double BinWidth() const { return (kRight - kLeft) / static_cast<double>(std::max<size_t>(bins, 1)); }
  double X(size_t bin) const { return kLeft + (static_cast<double>(bin) + 0.5) * BinWidth(); }
  double Y(double value) const {
    const double share = (value - ticks.front()) / (ticks.back() - ticks.front());
    return kBottom - std::clamp(share, 0.0, 1.0) * (kBottom - kTop);
  }
};

// It breaks where a value is missing.
std::string PathOf(const PlotArea& area, const std::vector<double>& means) {
  std::string path;
  bool drawing = false;
  for (size_t b = 0; b < means.size(); ++b) {
    const bool has_value = std::isfinite(means[b]);
    if (has_value)
      absl::StrAppendFormat(&path, "%c%.1f %.1f", drawing ? 'L' : 'M', area.X(b), area.Y(means[b]));
    drawing = has_value;
  }
  return path;
}

std::string AxisLabel(double x, absl::string_view anchor, const std::string& name) {
  return absl::StrFormat("<text class=\"tick\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%s</text>", x,
                         kBottom + 16, anchor, EscapeHtml(Shortened(name, 14)));
}

// Grid lines with their labels, frame names below.
std::string Axes(const PlotArea& area, const PlotFrames& frames, const std::vector<PlotBin>& bins,
                 const PlotText& text) {
  const std::vector<std::string> labels = TickLabels(area.ticks, text);
  std::string svg;
  for (size_t i = 0; i < labels.size(); ++i) {
    const double y = area.Y(area.ticks[i]);
    absl::StrAppendFormat(&svg,
                          "<line class=\"grid\" x1=\"%.0f\" x2=\"%.0f\" y1=\"%.1f\" y2=\"%.1f\"/><text "
                          "class=\"tick\" x=\"%.0f\" y=\"%.1f\" text-anchor=\"end\">%s</text>",
                          kLeft, kRight, y, y, kLeft - 6, y + 3.5, labels[i]);
  }
  const std::vector<std::string>& names = frames.names;
  if (names.size() == 1) return svg + AxisLabel(area.X(0), "middle", names[0]);
  if (names.empty()) return svg;
  svg += AxisLabel(kLeft, "start", names.front());
  if (bins.size() > 4) {
    const size_t half = bins.size() / 2;
    svg += AxisLabel(area.X(half), "middle", names[bins[half].begin]);
  }
  return svg + AxisLabel(kRight, "end", names.back());
}

// "frame 0012", "frames 0012 to 0019"; not escaped.
std::string BinName(const PlotBin& bin, const PlotFrames& frames) {
  const std::vector<std::string>& names = frames.names;
  if (bin.end - bin.begin == 1) return absl::StrCat("frame ", names[bin.begin]);
  return absl::StrCat("frames ", names[bin.begin], " to ", names[bin.end - 1]);
}

// Marks on the axis where frames have no mesh.
std::string LostMarks(const PlotArea& area, const PlotFrames& frames, const std::vector<PlotBin>& bins) {
  std::string svg;
  for (size_t b = 0; b < bins.size(); ++b) {
    int lost = 0;
    for (size_t i = bins[b].begin; i < bins[b].end; ++i) lost += frames.without_mesh[i];
    if (lost == 0) continue;
    const std::string what =
        bins[b].end - bins[b].begin == 1 ? ": no mesh" : absl::StrCat(": ", lost, " without mesh");
    absl::StrAppendFormat(&svg, "<path class=\"lost\" d=\"M%.1f %.1fl4 7h-8z\"><title>%s%s</title></path>",
                          area.X(b), kBottom - 7, EscapeHtml(BinName(bins[b], frames)), what);
  }
  return svg;
}

// Circle, square, triangle, diamond: by its class and, without colours, by its shape.
std::string Marker(size_t series, double x, double y, double r, const std::string& hover) {
  const std::string title = hover.empty() ? "" : absl::StrCat("<title>", EscapeHtml(hover), "</title>");
  switch (series) {
    case 0:
      return absl::StrFormat("<circle class=\"m0\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\">%s</circle>", x, y, r,
                             title);
    case 1:
      return absl::StrFormat(
          "<rect class=\"m1\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\">%s</rect>", x - r, y - r,
          2 * r, 2 * r, title);
    case 2:
      return absl::StrFormat("<path class=\"m2\" d=\"M%.1f %.1fl%.1f %.1fh%.1fz\">%s</path>", x, y - 1.2 * r,
                             1.2 * r, 2.1 * r, -2.4 * r, title);
    default:
      return absl::StrFormat("<path class=\"m3\" d=\"M%.1f %.1fl%.1f %.1fl%.1f %.1fl%.1f %.1fz\">%s</path>",
                             x, y - 1.3 * r, 1.3 * r, 1.3 * r, -1.3 * r, 1.3 * r, -1.3 * r, -1.3 * r, title);
  }
}

std::string LineSample(size_t series, double x, double y) {
  return absl::StrFormat("<path class=\"series s%d\" d=\"M%.0f %.1fh26\"/>%s", series, x, y,
                         Marker(series, x + 13, y, 3.2, ""));
}

size_t Style(size_t series, const PlotText& text) { return (series + text.first_style) % kMaxSeries; }

std::string Draw(const PlotFrames& frames, const std::vector<PlotSeries>& series, const PlotText& text) {
  const std::vector<PlotBin> bins = MakeBins(frames.names.size());
  std::vector<std::vector<double>> means;
  for (const PlotSeries& one : series) means.push_back(MeansOf(bins, one.values));
  const PlotArea area{bins.size(), ValueTicks(means, text)};
  std::string svg = Axes(area, frames, bins, text);
  for (size_t s = 0; s < means.size(); ++s)
    absl::StrAppendFormat(&svg, "<path class=\"series s%d\" d=\"%s\"/>", Style(s, text),
                          PathOf(area, means[s]));
  const double radius = std::clamp(area.BinWidth() * 0.3, 1.6, 3.4);
  const bool few = bins.size() <= kMostOverlaidBins / 2;
  for (size_t s = 0; s < means.size(); ++s)
    for (size_t b = 0; b < bins.size(); ++b) {
      if (!HasValue(means[s], b)) continue;
      const double r = few || IsAlone(means[s], b) ? radius : 1.1;
      svg += Marker(
          Style(s, text), area.X(b), area.Y(means[s][b]), r,
          absl::StrCat(BinName(bins[b], frames), ", ", series[s].name, ": ", ValueText(means[s][b], text)));
    }
  return svg + LostMarks(area, frames, bins);
}

}  // namespace

std::string OverlaidPlotSvg(const PlotFrames& frames, const std::vector<PlotSeries>& all,
                            const PlotText& text) {
  constexpr double kLegendHeight = 18;
  constexpr size_t kShownCharacters = 30;
  const std::vector<PlotSeries> series(
      all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), kMaxSeries)));
  const double step = (kWidth - 20) / static_cast<double>(std::max<size_t>(series.size(), 1));
  std::string body;
  for (size_t s = 0; s < series.size(); ++s) {
    const double x = 10 + step * static_cast<double>(s);
    absl::StrAppend(&body, LineSample(Style(s, text), x, 7),
                    absl::StrFormat("<text x=\"%.0f\" y=\"11\">%s</text>", x + 33,
                                    EscapeHtml(Shortened(series[s].name, kShownCharacters))));
  }
  absl::StrAppendFormat(&body, "<g transform=\"translate(0 %.0f)\">%s</g>", kLegendHeight,
                        Draw(frames, series, text));
  return SvgFile(kWidth, kHeight + kLegendHeight, text.title, body);
}

}  // namespace weft
