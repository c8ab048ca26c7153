// Several series over the same frames.
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"
#include "services/results/report/plot.h"
#include "services/results/report/plot_axes.h"
#include "services/results/report/svg_file.h"

namespace weft {
namespace {

constexpr size_t kMostOverlaidBins = 120;

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

struct OverlaidPicture {
  std::string body;
  std::vector<std::string> names;
};

OverlaidPicture Draw(const PlotFrames& frames, const std::vector<PlotSeries>& all, const PlotText& text) {
  const std::vector<PlotBin> bins = MakeBins(frames.names.size(), kMostOverlaidBins);
  std::vector<std::vector<BinValues>> means;
  std::vector<BinValues> everything;
  OverlaidPicture out;
  for (size_t s = 0; s < std::min(all.size(), kMaxSeries); ++s) {
    std::vector<BinValues>& of_series = means.emplace_back();
    for (const PlotBin& bin : bins) {
      BinValues values = ValuesIn(bin, all[s].values);
      values.low = values.high = values.mean;
      of_series.push_back(values);
    }
    everything.insert(everything.end(), of_series.begin(), of_series.end());
    out.names.push_back(all[s].name);
  }
  const PlotArea area(std::max<size_t>(bins.size(), 1), ValueTicks(everything, text));
  out.body = area.Axes(frames, bins, TickLabels(area.ticks(), text));
  for (size_t s = 0; s < means.size(); ++s)
    absl::StrAppendFormat(&out.body, "<path class=\"series s%d\" d=\"%s\"/>", Style(s, text),
                          area.Path(means[s]));
  const double radius = std::clamp(area.bin_width() * 0.3, 1.6, 3.4);
  const bool few = bins.size() <= kMostOverlaidBins / 2;
  for (size_t s = 0; s < means.size(); ++s)
    for (size_t b = 0; b < bins.size(); ++b) {
      if (!HasValue(means[s], b)) continue;
      const double r = few || IsAlone(means[s], b) ? radius : 1.1;
      out.body += Marker(
          Style(s, text), area.x(b), area.y(means[s][b].mean), r,
          absl::StrCat(BinName(bins[b], frames), ", ", all[s].name, ": ", ValueText(means[s][b].mean, text)));
    }
  out.body += area.LostMarks(frames, bins);
  return out;
}

}  // namespace

std::string OverlaidPlot(const PlotFrames& frames, const std::vector<PlotSeries>& series,
                         const PlotText& text) {
  const OverlaidPicture picture = Draw(frames, series, text);
  std::string legend = "<ul class=\"legend\">";
  for (size_t s = 0; s < picture.names.size(); ++s)
    absl::StrAppend(&legend, "<li><svg class=\"sample\" viewBox=\"0 0 28 10\" aria-hidden=\"true\">",
                    LineSample(Style(s, text), 1, 5), "</svg>", EscapeHtml(picture.names[s]), "</li>");
  return PlotFigure(text, legend + "</ul>", picture.body);
}

std::string OverlaidPlotSvg(const PlotFrames& frames, const std::vector<PlotSeries>& series,
                            const PlotText& text) {
  constexpr double kLegendHeight = 18;
  constexpr size_t kShownCharacters = 30;
  const OverlaidPicture picture = Draw(frames, series, text);
  const double step =
      (PlotArea::kWidth - 20) / static_cast<double>(std::max<size_t>(picture.names.size(), 1));
  std::string body;
  for (size_t s = 0; s < picture.names.size(); ++s) {
    const double x = 10 + step * static_cast<double>(s);
    absl::StrAppend(&body, LineSample(Style(s, text), x, 7),
                    absl::StrFormat("<text x=\"%.0f\" y=\"11\">%s</text>", x + 33,
                                    EscapeHtml(Shortened(picture.names[s], kShownCharacters))));
  }
  absl::StrAppendFormat(&body, "<g transform=\"translate(0 %.0f)\">%s</g>", kLegendHeight, picture.body);
  return SvgFile(PlotArea::kWidth, PlotArea::kHeight + kLegendHeight, text.title, body);
}

}  // namespace weft
