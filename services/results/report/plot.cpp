#include "services/results/report/plot.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"
#include "services/results/report/plot_axes.h"

namespace weft {
namespace {

constexpr size_t kMaxPoints = 120;
constexpr size_t kMaxBars = 100;
constexpr size_t kMaxLayers = 8;

// Lowest to highest value of every bin as a bar, with the hover text.
std::string Ranges(const PlotArea& area, const PlotFrames& frames, const std::vector<PlotBin>& bins,
                   const std::vector<BinValues>& values, const PlotText& text) {
  std::string svg;
  for (size_t b = 0; b < bins.size(); ++b) {
    if (!std::isfinite(values[b].mean)) continue;
    const double top = area.y(values[b].high), height = std::max(1.5, area.y(values[b].low) - top);
    absl::StrAppendFormat(&svg,
                          "<rect class=\"range\" x=\"%.2f\" y=\"%.1f\" width=\"%.2f\" "
                          "height=\"%.1f\"><title>%s: mean %s, %s to "
                          "%s</title></rect>",
                          area.x(b) - area.bin_width() / 2, top, area.bin_width(), height,
                          EscapeHtml(BinName(bins[b], frames)), ValueText(values[b].mean, text),
                          ValueText(values[b].low, text), ValueText(values[b].high, text));
  }
  return svg;
}

std::string Points(const PlotArea& area, const PlotFrames& frames, const std::vector<PlotBin>& bins,
                   const std::vector<BinValues>& values, const PlotText& text, bool only_lone) {
  std::string svg;
  const double radius = std::clamp(area.bin_width() * 0.35, only_lone ? 2.5 : 1.6, 3.5);
  for (size_t b = 0; b < bins.size(); ++b) {
    if (!HasValue(values, b) || (only_lone && !IsAlone(values, b))) continue;
    absl::StrAppendFormat(
        &svg, "<circle class=\"point\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"><title>%s: %s</title></circle>",
        area.x(b), area.y(values[b].mean), radius, EscapeHtml(BinName(bins[b], frames)),
        ValueText(values[b].mean, text));
  }
  return svg;
}

std::vector<PlotLayer> Folded(const std::vector<PlotLayer>& layers) {
  if (layers.size() <= kMaxLayers) return layers;
  std::vector<PlotLayer> folded(layers.begin(), layers.begin() + (kMaxLayers - 1));
  PlotLayer other{"other", std::vector<double>(layers[0].values.size(), 0)};
  for (size_t l = kMaxLayers - 1; l < layers.size(); ++l) {
    for (size_t i = 0; i < other.values.size(); ++i) {
      if (std::isfinite(layers[l].values[i])) other.values[i] += layers[l].values[i];
    }
  }
  folded.push_back(std::move(other));
  return folded;
}

std::string Legend(const std::vector<PlotLayer>& layers) {
  std::string html = "<ul class=\"legend\">";
  for (size_t l = 0; l < layers.size(); ++l) {
    absl::StrAppend(&html, "<li><i class=\"f", l, "\"></i>", EscapeHtml(Words(layers[l].name)), "</li>");
  }
  return html + "</ul>";
}

// Means of every layer in every bin: [layers][bins].
std::vector<std::vector<double>> LayerMeans(const std::vector<PlotLayer>& layers,
                                            const std::vector<PlotBin>& bins) {
  std::vector<std::vector<double>> means;
  for (const PlotLayer& layer : layers) {
    std::vector<double>& row = means.emplace_back();
    for (const PlotBin& bin : bins) {
      const double mean = ValuesIn(bin, layer.values).mean;
      row.push_back(std::isfinite(mean) && mean > 0 ? mean : 0);
    }
  }
  return means;
}

// Durations need a unit that fits them all.
struct TimeUnit {
  double ms = 1;
  absl::string_view name = "ms";
};
TimeUnit UnitFor(double highest_ms) {
  if (highest_ms > 180'000) return {60'000, "min"};
  if (highest_ms > 1500) return {1000, "s"};
  return {1, "ms"};
}

}  // namespace

std::string LinePlot(const PlotFrames& frames, const std::vector<double>& values, const PlotText& text) {
  const std::vector<PlotBin> bins = MakeBins(frames.names.size(), kMaxPoints);
  std::vector<BinValues> in_bins;
  for (const PlotBin& bin : bins) in_bins.push_back(ValuesIn(bin, values));
  const PlotArea area(std::max<size_t>(bins.size(), 1), ValueTicks(in_bins, text));
  std::string svg = area.Axes(frames, bins, TickLabels(area.ticks(), text));
  const bool single_frames = frames.names.size() <= kMaxPoints;
  if (!single_frames) svg += Ranges(area, frames, bins, in_bins, text);
  absl::StrAppend(&svg, "<path class=\"line\" d=\"", area.Path(in_bins), "\"/>");
  svg += Points(area, frames, bins, in_bins, text, !single_frames);
  svg += area.LostMarks(frames, bins);
  return PlotFigure(text, "", svg);
}

std::string BarPlot(const PlotFrames& frames, const std::vector<double>& values, const PlotText& text) {
  const std::vector<PlotBin> bins = MakeBins(frames.names.size(), kMaxBars);
  std::vector<BinValues> in_bins;
  for (const PlotBin& bin : bins) in_bins.push_back(ValuesIn(bin, values));
  double highest = 0;
  for (const BinValues& bin : in_bins)
    if (std::isfinite(bin.mean)) highest = std::max(highest, bin.mean);
  const PlotArea area(std::max<size_t>(bins.size(), 1), RoundTicks(0, highest));
  std::string svg = area.Axes(frames, bins, TickLabels(area.ticks(), text));
  const double width = area.bin_width() * 0.8;
  for (size_t b = 0; b < bins.size(); ++b) {
    if (!std::isfinite(in_bins[b].mean)) continue;
    const double top = area.y(in_bins[b].mean);
    absl::StrAppendFormat(&svg,
                          "<rect class=\"f0\" x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" "
                          "height=\"%.2f\"><title>%s: %s</title></rect>",
                          area.x(b) - width / 2, top, width, PlotArea::kBottom - top,
                          EscapeHtml(BinName(bins[b], frames)), ValueText(in_bins[b].mean, text));
  }
  return PlotFigure(text, "", svg);
}

std::string StackedPlot(const PlotFrames& frames, const std::vector<PlotLayer>& all_layers,
                        const PlotText& text) {
  const std::vector<PlotLayer> layers = Folded(all_layers);
  const std::vector<PlotBin> bins = MakeBins(frames.names.size(), kMaxBars);
  const std::vector<std::vector<double>> means = LayerMeans(layers, bins);
  std::vector<double> total(bins.size(), 0);
  for (const auto& row : means) {
    for (size_t b = 0; b < bins.size(); ++b) total[b] += row[b];
  }
  const double highest_ms = total.empty() ? 0 : *std::ranges::max_element(total);
  const TimeUnit unit = UnitFor(highest_ms);
  const PlotArea area(std::max<size_t>(bins.size(), 1), RoundTicks(0, highest_ms / unit.ms));
  std::vector<std::string> labels = TickLabels(area.ticks(), {});
  for (std::string& label : labels) absl::StrAppend(&label, "\xC2\xA0", unit.name);
  std::string svg = area.Axes(frames, bins, labels);
  const double width = std::min(area.bin_width() * (bins.size() > 60 ? 1.0 : 0.72), 60.0);
  for (size_t b = 0; b < bins.size(); ++b) {
    double below = 0;
    for (size_t l = 0; l < layers.size(); ++l) {
      const double top = below + means[l][b];
      if (means[l][b] > 0) {
        absl::StrAppendFormat(&svg,
                              "<rect class=\"f%d\" x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" "
                              "height=\"%.2f\"><title>%s: %s %s of %s</title></rect>",
                              l, area.x(b) - width / 2, area.y(top / unit.ms), width,
                              area.y(below / unit.ms) - area.y(top / unit.ms),
                              EscapeHtml(BinName(bins[b], frames)), EscapeHtml(Words(layers[l].name)),
                              FormatDuration(means[l][b]), FormatDuration(total[b]));
      }
      below = top;
    }
  }
  svg += area.LostMarks(frames, bins);
  return PlotFigure(text, Legend(layers), svg);
}

}  // namespace weft
