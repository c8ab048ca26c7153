#include "services/results/report/heat_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

PlotFrames Sets(size_t count) {
  PlotFrames frames;
  frames.noun = "set";
  for (size_t i = 0; i < count; ++i) frames.names.push_back(std::to_string(i));
  frames.without_mesh.assign(count, false);
  return frames;
}

TEST(HeatMap, HoldsManyRowsInOnePicture) {
  std::vector<HeatMapRow> rows;
  for (int r = 0; r < 200; ++r)
    rows.push_back({"cam" + std::to_string(r), std::vector<double>(5000, 0.01 * r), ""});
  const std::string html = HeatMap(Sets(5000), rows, {"Offset", "ms", 4, false}, HeatMapGaps::kAreFaults);
  EXPECT_LT(html.size(), 60'000u);
  EXPECT_THAT(html, AllOf(HasSubstr("<title>cam199</title>"), HasSubstr(">cam0</text>"),
                          Not(HasSubstr(">cam1</text>")), HasSubstr("viewBox=\"0 0 1120 846\""),
                          HasSubstr("frame missing")));
}

TEST(HeatMap, EndsItsScaleAtARoundNumber) {
  const std::vector<HeatMapRow> rows = {{"a<", {0.3, -0.4, 0.2}, ": note"},
                                        {"b", {std::nan(""), 0, 0.1}, ""}};
  const std::string html = HeatMap(Sets(3), rows, {"Offset", "ms", 4, false}, HeatMapGaps::kAreBlank);
  EXPECT_THAT(
      html, AllOf(HasSubstr(">-0.5\xC2\xA0ms<"), HasSubstr("a&lt;: note"), Not(HasSubstr("frame missing"))));
  EXPECT_EQ(HeatMap(Sets(0), {}, {}, HeatMapGaps::kAreBlank), "");
}

}  // namespace
}  // namespace weft
