// Many series over one axis in one picture: a row each, colours for values.
#pragma once

#include <string>
#include <vector>

#include "services/results/report/plot.h"

namespace weft {

struct HeatMapRow {
  std::string name;
  std::vector<double> values;  // as many as there are frames; NaN where there is none
  std::string note;            // hover text, after the name
};

enum class HeatMapGaps { kAreFaults, kAreBlank };  // what a NaN is

// Values around 0 from blue over white to orange; the ends of the scale hold all but the highest 2 % of the
// values. Up to 360 bins of frames, each with the value that is farthest from 0; a bin in which a value is
// missing is red where gaps are faults. 200 rows fit one screen.
std::string HeatMap(const PlotFrames& frames, const std::vector<HeatMapRow>& rows, const PlotText& text,
                    HeatMapGaps gaps);

}  // namespace weft
