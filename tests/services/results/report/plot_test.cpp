#include "services/results/report/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/results/report/plot_axes.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

PlotFrames Frames(size_t count) {
  PlotFrames frames;
  for (size_t i = 0; i < count; ++i) frames.names.push_back(std::to_string(i));
  frames.without_mesh.assign(count, false);
  return frames;
}

TEST(Plot, BinsHoldEveryFrameOnce) {
  for (const size_t count : {1u, 119u, 120u, 121u, 240u, 1000u, 100'003u}) {
    const std::vector<PlotBin> bins = MakeBins(count, 120);
    EXPECT_LE(bins.size(), 120u);
    size_t next = 0;
    for (const PlotBin& bin : bins) {
      EXPECT_EQ(bin.begin, next);
      EXPECT_GT(bin.end, bin.begin);
      next = bin.end;
    }
    EXPECT_EQ(next, count);
  }
  EXPECT_TRUE(MakeBins(0, 120).empty());
}

TEST(Plot, TicksAreRoundAndHoldTheRange) {
  EXPECT_THAT(RoundTicks(0, 10), ElementsAre(0, 2.5, 5, 7.5, 10));
  EXPECT_THAT(RoundTicks(0, 0), ElementsAre(0, 0.25, 0.5, 0.75, 1));
  for (const auto& [low, high] :
       {std::pair{0.0, 11'730.0}, {0.0, 0.087}, {-3.0, 4.5}, {5.0, 5.0}, {0.0, 1e-9}}) {
    const std::vector<double> ticks = RoundTicks(low, high);
    EXPECT_GE(ticks.size(), 3u);
    EXPECT_LE(ticks.size(), 7u);
    EXPECT_LE(ticks.front(), low + 1e-12);
    EXPECT_GE(ticks.back(), high * (1 - 1e-12));
  }
}

TEST(Plot, LineBreaksWhereAValueIsMissing) {
  PlotFrames frames = Frames(5);
  frames.without_mesh[2] = true;
  const std::string svg = LinePlot(frames, {1, 2, std::nan(""), 4, 5}, {.title = "Cells"});
  const size_t path = svg.find("class=\"line\" d=\"");
  const std::string data = svg.substr(path + 16, svg.find('"', path + 16) - path - 16);
  EXPECT_EQ(std::count(data.begin(), data.end(), 'M'), 2);
  EXPECT_EQ(std::count(data.begin(), data.end(), 'L'), 2);
  EXPECT_THAT(svg, HasSubstr("frame 2: no mesh"));
  EXPECT_THAT(svg, HasSubstr("frame 4: 5<"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(Plot, ValuesOfAFewOfManyFramesArePoints) {
  std::vector<double> values(400, std::nan(""));
  for (size_t i = 10; i < values.size(); i += 20) values[i] = 2;
  for (size_t i = 198; i < 204; ++i) values[i] = 3;
  const std::string svg = LinePlot(Frames(400), values, {.title = "Drift"});
  size_t points = 0;
  for (size_t at = svg.find("<circle"); at != std::string::npos; at = svg.find("<circle", at + 1)) ++points;
  EXPECT_EQ(points, 20u);  // and a line where neighbours have values
}

TEST(Plot, PlotOfNothingHasAxesOnly) {
  const double none = std::nan("");
  const std::string svg = LinePlot(Frames(3), {none, none, none}, {.title = "Coverage", .unit = "%"});
  EXPECT_THAT(svg, HasSubstr("100\xC2\xA0%"));
  EXPECT_THAT(svg, Not(HasSubstr("<circle")));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(Plot, BarsStackToTheTotalOfTheFrame) {
  const std::string svg =
      StackedPlot(Frames(1), {{"decode", {3000}}, {"align", {1000}}}, {.title = "Time per stage"});
  // 4 s fill the axis from the bottom at 186 to the top at 14.
  EXPECT_THAT(
      svg, HasSubstr(
               "y=\"57.00\" width=\"60.00\" height=\"129.00\"><title>frame 0: decode 3.00\xC2\xA0s of 4.00"));
  EXPECT_THAT(svg, HasSubstr("y=\"14.00\" width=\"60.00\" height=\"43.00\"><title>frame 0: align"));
}

TEST(Plot, ManyLayersAreFoldedIntoOther) {
  std::vector<PlotLayer> layers;
  for (int i = 0; i < 11; ++i) layers.push_back({"stage_" + std::to_string(i), {10}});
  const std::string svg = StackedPlot(Frames(1), layers, {.title = "Time"});
  EXPECT_THAT(svg, HasSubstr("stage 6"));
  EXPECT_THAT(svg, Not(HasSubstr("stage 7")));
  EXPECT_THAT(svg, HasSubstr("other 40\xC2\xA0ms of 110\xC2\xA0ms"));
}

TEST(OverlaidPlot, SeriesDifferWithoutColoursToo) {
  const std::string html = OverlaidPlot(Frames(3), {{"A <1>", {1, 2, 3}}, {"B", {1.5, std::nan(""), 2.5}}},
                                        {.title = "Error, mm", .unit = "mm", .decimals = 2});
  EXPECT_THAT(html, HasSubstr("class=\"series s0\""));
  EXPECT_THAT(html, HasSubstr("class=\"series s1\""));
  EXPECT_THAT(html, HasSubstr("<circle class=\"m0\""));
  EXPECT_THAT(html, HasSubstr("<rect class=\"m1\""));
  EXPECT_THAT(html, HasSubstr("frame 0, A &lt;1&gt;: 1.00\xC2\xA0mm"));
  EXPECT_THAT(html, HasSubstr("</svg>A &lt;1&gt;</li>"));
  EXPECT_THAT(html, Not(HasSubstr("frame 1, B")));
}

TEST(OverlaidPlot, PercentagesNeedNotEndAtAHundred) {
  const std::vector<PlotSeries> series = {{"A", {0.021, 0.024}}, {"B", {0.026, 0.025}}};
  const std::string whole = OverlaidPlot(Frames(2), series, {.title = "t", .unit = "%"});
  const std::string close = OverlaidPlot(
      Frames(2), series, {.title = "t", .unit = "%", .from_zero = false, .whole_percent = false});
  EXPECT_THAT(whole, HasSubstr(">100\xC2\xA0%</text>"));
  EXPECT_THAT(close, Not(HasSubstr(">100\xC2\xA0%</text>")));
}

TEST(OverlaidPlot, LongSequencesAreBinned) {
  const std::vector<PlotSeries> series = {{"A", std::vector<double>(10'000, 1)},
                                          {"B", std::vector<double>(10'000, 2)}};
  EXPECT_LT(OverlaidPlot(Frames(10'000), series, {.title = "t"}).size(), 60'000u);
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

}  // namespace
}  // namespace weft
