#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/results/report/plot.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const PlotFrames kTwoFrames = {.names = {"1", "2"}, .without_mesh = {false, false}};

TEST(OverlaidPlot, SeriesBeyondTheFourthAreLeftOut) {
  std::vector<PlotSeries> series;
  for (const char* name : {"a", "b", "c", "d", "e"}) series.push_back({name, {1, 2}});
  const std::string html = OverlaidPlot(kTwoFrames, series, {.title = "Title"});
  EXPECT_THAT(html, HasSubstr("</svg>d</li>"));
  EXPECT_THAT(html, Not(HasSubstr("</svg>e</li>")));
}

TEST(OverlaidPlot, SeriesMayBeginWithAnotherLook) {
  const std::vector<PlotSeries> series = {{"a", {1, 2}}};
  EXPECT_THAT(OverlaidPlot(kTwoFrames, series, {}), HasSubstr("series s0"));
  const std::string third = OverlaidPlot(kTwoFrames, series, {.first_style = 2});
  EXPECT_THAT(third, HasSubstr("series s2"));
  EXPECT_THAT(third, Not(HasSubstr("series s0")));
}

TEST(OverlaidPlot, MissingValuesHaveNoPoint) {
  const std::string html =
      OverlaidPlot(kTwoFrames, {{"a", {1, std::nan("")}}}, {.unit = "mm", .decimals = 1});
  EXPECT_THAT(html, HasSubstr("<title>frame 1, a: 1.0\xC2\xA0mm</title>"));
  EXPECT_THAT(html, Not(HasSubstr("<title>frame 2")));
}

TEST(OverlaidPlot, FilesEscapeAndShortenNames) {
  const std::string svg = OverlaidPlotSvg(kTwoFrames, {{"<" + std::string(40, 'x'), {1, 2}}}, {});
  EXPECT_THAT(svg, HasSubstr(">&lt;" + std::string(29, 'x') + "\xE2\x80\xA6<"));
}

}  // namespace
}  // namespace weft
