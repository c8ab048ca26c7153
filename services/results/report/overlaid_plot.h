// Several series over the frames of a job as an SVG file, in the colours for paper. Pages draw theirs
// themselves (page/plot.js), with the same axes.
#pragma once

#include <string>
#include <vector>

namespace weft {

// What all plots of a report share.
struct PlotFrames {
  std::vector<std::string> names;  // [frames]
  std::vector<bool> without_mesh;  // [frames]; marked on the axis
};

struct PlotText {
  std::string title;
  std::string unit;  // "mm", or "%" with values from 0 to 1
  int decimals = 0;  // of the numbers in the hover text
  bool from_zero = true;
  bool whole_percent = true;  // an axis of percentages ends at 100 %
  size_t first_style = 0;     // which of the four looks the first series has
};

struct PlotSeries {
  std::string name;
  std::vector<double> values;  // [frames], NaN where there is none
};

// Up to kMaxSeries lines over the same frames; more than 120 frames are binned, each bin with its mean. Lines
// differ in colour (Okabe and Ito 2008, seen by the colour-blind), in dashes and in the shape of their
// points.
inline constexpr size_t kMaxSeries = 4;
std::string OverlaidPlotSvg(const PlotFrames& frames, const std::vector<PlotSeries>& series,
                            const PlotText& text);

}  // namespace weft
