// Frame axis, value axis and bins of the plots.
#pragma once

#include <string>
#include <vector>

#include "services/results/report/plot.h"

namespace weft {

// Consecutive frames that are drawn as one: [begin, end).
struct PlotBin {
  size_t begin = 0;
  size_t end = 0;
};
// At most `max_bins` bins of equal size (the last may be smaller); no bin is empty.
std::vector<PlotBin> MakeBins(size_t frames, size_t max_bins);

// Mean, lowest and highest of the finite values of a bin; NaN when there are none.
struct BinValues {
  double mean = 0;
  double low = 0;
  double high = 0;
};
BinValues ValuesIn(const PlotBin& bin, const std::vector<double>& values);

// Round numbers from at most `low` to at least `high`, three to seven of them.
std::vector<double> RoundTicks(double low, double high);

// "0.142 mm", "95.2 %".
std::string ValueText(double value, const PlotText& text);
// One per tick, with as many decimals as they need.
std::vector<std::string> TickLabels(const std::vector<double>& ticks, const PlotText& text);
// Ticks that hold the values; whole percentages end at 100.
std::vector<double> ValueTicks(const std::vector<BinValues>& bins, const PlotText& text);

bool HasValue(const std::vector<BinValues>& values, size_t bin);
// Where no line leads to a value, as in metrics of a sample of the frames.
bool IsAlone(const std::vector<BinValues>& values, size_t bin);

// Where things are in the picture, in its units.
class PlotArea {
 public:
  static constexpr double kWidth = 560, kHeight = 220, kLeft = 62, kRight = 548, kTop = 14, kBottom = 186;

  PlotArea(size_t bins, std::vector<double> ticks) : bins_(bins), ticks_(std::move(ticks)) {}

  double x(size_t bin) const { return kLeft + (static_cast<double>(bin) + 0.5) * bin_width(); }
  double bin_width() const { return (kRight - kLeft) / static_cast<double>(bins_); }
  double y(double value) const;

  // Grid lines with their labels, frame names below.
  std::string Axes(const PlotFrames& frames, const std::vector<PlotBin>& bins,
                   const std::vector<std::string>& tick_labels) const;
  // The values as path data; it breaks where one is missing.
  std::string Path(const std::vector<BinValues>& bins) const;
  // Marks on the axis where frames have no mesh.
  std::string LostMarks(const PlotFrames& frames, const std::vector<PlotBin>& bins) const;
  const std::vector<double>& ticks() const { return ticks_; }

 private:
  size_t bins_;
  std::vector<double> ticks_;
};

// "frame 0012", "frames 0012 to 0019"; not escaped.
std::string BinName(const PlotBin& bin, const PlotFrames& frames);

// <figure> with the caption and the picture around `body`.
std::string PlotFigure(const PlotText& text, const std::string& legend, const std::string& body);

}  // namespace weft
