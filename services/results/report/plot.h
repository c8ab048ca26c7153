// Plots over the frames of a job as inline SVG. Colours come from the page's style sheet.
#pragma once

#include <string>
#include <vector>

namespace weft {

// What all plots of a report share.
struct PlotFrames {
  std::vector<std::string> names;  // [frames]
  std::vector<bool> without_mesh;  // [frames]; marked on the axis
  std::string noun = "frame";      // what the hover text calls them
};

struct PlotText {
  std::string title;
  std::string unit;  // "mm", or "%" with values from 0 to 1
  int decimals = 0;  // of the numbers in the hover text
  bool from_zero = true;
  bool whole_percent = true;  // an axis of percentages ends at 100 %
  size_t first_style = 0;     // of overlaid series: which of the four looks the first one has
};

// One value per frame, NaN where there is none. Up to 120 frames are points on a line that breaks at
// missing values. More are binned, each bin with its mean, minimum and maximum, and a point where both
// neighbours are missing.
std::string LinePlot(const PlotFrames& frames, const std::vector<double>& values, const PlotText& text);

// A bar per value, each named by `frames`; at most 100 of them.
std::string BarPlot(const PlotFrames& frames, const std::vector<double>& values, const PlotText& text);

struct PlotSeries {
  std::string name;
  std::vector<double> values;  // [frames], NaN where there is none
};
// Up to kMaxSeries lines over the same frames; more than 120 frames are binned, each bin with its mean. Lines
// differ in colour (Okabe and Ito 2008, seen by the colour-blind), in dashes and in the shape of their
// points.
inline constexpr size_t kMaxSeries = 4;
std::string OverlaidPlot(const PlotFrames& frames, const std::vector<PlotSeries>& series,
                         const PlotText& text);
// The same as an SVG file, in the colours for paper.
std::string OverlaidPlotSvg(const PlotFrames& frames, const std::vector<PlotSeries>& series,
                            const PlotText& text);

struct PlotLayer {
  std::string name;
  std::vector<double> values;  // [frames]
};
// The layers on top of each other, a bar per frame, or per bin of frames with their mean. Layers beyond the
// seventh are drawn as one named "other". Values are milliseconds and shown as durations.
std::string StackedPlot(const PlotFrames& frames, const std::vector<PlotLayer>& layers, const PlotText& text);

}  // namespace weft
