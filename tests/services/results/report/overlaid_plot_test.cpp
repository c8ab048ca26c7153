#include "services/results/report/overlaid_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

PlotFrames Frames(size_t count) {
  PlotFrames frames;
  for (size_t i = 0; i < count; ++i) frames.names.push_back(std::to_string(i));
  frames.without_mesh.assign(count, false);
  return frames;
}

TEST(OverlaidPlot, IsAnSvgFileWithItsOwnStyle) {
  const std::string svg =
      OverlaidPlotSvg(Frames(2), {{"A", {1, 2}}, {"B", {2, 1}}}, {.title = "Error & more, mm", .unit = "mm"});
  EXPECT_THAT(svg, HasSubstr("<?xml version=\"1.0\""));
  EXPECT_THAT(svg, HasSubstr("xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_THAT(svg, HasSubstr("<title>Error &amp; more, mm</title>"));
  EXPECT_THAT(svg, HasSubstr(".s1{stroke:#d55e00"));
  EXPECT_THAT(svg, Not(HasSubstr("var(--")));
}

TEST(OverlaidPlot, SeriesDifferWithoutColoursToo) {
  const std::string svg = OverlaidPlotSvg(Frames(3), {{"A <1>", {1, 2, 3}}, {"B", {1.5, std::nan(""), 2.5}}},
                                          {.title = "Error, mm", .unit = "mm", .decimals = 2});
  EXPECT_THAT(svg, HasSubstr("class=\"series s0\""));
  EXPECT_THAT(svg, HasSubstr("class=\"series s1\""));
  EXPECT_THAT(svg, HasSubstr("<circle class=\"m0\""));
  EXPECT_THAT(svg, HasSubstr("<rect class=\"m1\""));
  EXPECT_THAT(svg, HasSubstr("frame 0, A &lt;1&gt;: 1.00\xC2\xA0mm"));
  EXPECT_THAT(svg, HasSubstr(">A &lt;1&gt;</text>"));
  EXPECT_THAT(svg, Not(HasSubstr("frame 1, B")));
}

TEST(OverlaidPlot, LinesBreakWhereAValueIsMissing) {
  PlotFrames frames = Frames(5);
  frames.without_mesh[2] = true;
  const std::string svg = OverlaidPlotSvg(frames, {{"A", {1, 2, std::nan(""), 4, 5}}}, {.title = "Cells"});
  const size_t path = svg.rfind("class=\"series s0\" d=\"") + 21;
  const std::string data = svg.substr(path, svg.find('"', path) - path);
  EXPECT_EQ(std::count(data.begin(), data.end(), 'M'), 2);
  EXPECT_EQ(std::count(data.begin(), data.end(), 'L'), 2);
  EXPECT_THAT(svg, HasSubstr("frame 2: no mesh"));
  EXPECT_THAT(svg, HasSubstr("frame 4, A: 5<"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(OverlaidPlot, PercentagesNeedNotEndAtAHundred) {
  const std::vector<PlotSeries> series = {{"A", {0.021, 0.024}}, {"B", {0.026, 0.025}}};
  const std::string whole = OverlaidPlotSvg(Frames(2), series, {.title = "t", .unit = "%"});
  const std::string close = OverlaidPlotSvg(
      Frames(2), series, {.title = "t", .unit = "%", .from_zero = false, .whole_percent = false});
  EXPECT_THAT(whole, HasSubstr(">100\xC2\xA0%</text>"));
  EXPECT_THAT(close, Not(HasSubstr(">100\xC2\xA0%</text>")));
}

TEST(OverlaidPlot, AxesStartAtZeroOnlyWhereAsked) {
  const std::vector<PlotSeries> series = {{"A", {10, 14}}};
  EXPECT_THAT(OverlaidPlotSvg(Frames(2), series, {}), HasSubstr("\"end\">0</text>"));
  EXPECT_THAT(OverlaidPlotSvg(Frames(2), series, {.from_zero = false}), Not(HasSubstr("\"end\">0</text>")));
  EXPECT_THAT(OverlaidPlotSvg(Frames(1), {{"A", {std::nan("")}}}, {}), HasSubstr(">0.25</text>"));
}

TEST(OverlaidPlot, LongSequencesAreBinned) {
  const std::vector<PlotSeries> series = {{"A", std::vector<double>(10'000, 1)},
                                          {"B", std::vector<double>(10'000, 2)}};
  const std::string svg = OverlaidPlotSvg(Frames(10'000), series, {.title = "t"});
  EXPECT_LT(svg.size(), 60'000u);
  EXPECT_THAT(svg, HasSubstr("frames 0 to 83, A: 1<"));
}

TEST(OverlaidPlot, SeriesBeyondTheFourthAreLeftOut) {
  std::vector<PlotSeries> series;
  for (const char* name : {"a", "b", "c", "d", "e"}) series.push_back({name, {1, 2}});
  const std::string svg = OverlaidPlotSvg(Frames(2), series, {.title = "Title"});
  EXPECT_THAT(svg, HasSubstr(">d</text>"));
  EXPECT_THAT(svg, Not(HasSubstr(">e</text>")));
}

TEST(OverlaidPlot, SeriesMayBeginWithAnotherLook) {
  const std::string third = OverlaidPlotSvg(Frames(2), {{"a", {1, 2}}}, {.first_style = 2});
  EXPECT_THAT(third, HasSubstr("series s2"));
  EXPECT_THAT(third, Not(HasSubstr("series s0")));
}

TEST(OverlaidPlot, NamesAreEscapedAndShortened) {
  const std::string svg = OverlaidPlotSvg(Frames(2), {{"<" + std::string(40, 'x'), {1, 2}}}, {});
  EXPECT_THAT(svg, HasSubstr(">&lt;" + std::string(29, 'x') + "\xE2\x80\xA6<"));
}

}  // namespace
}  // namespace weft
