#include "services/results/report/overlaid_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/services/results/report/svg_lines.h"

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

TEST(OverlaidPlot, TheWholePictureOfThreeFrames) {
  PlotFrames frames = Frames(3);
  frames.without_mesh[1] = true;
  EXPECT_EQ(SvgLines(OverlaidPlotSvg(frames, {{"A", {1, std::nan(""), 4}}, {"B", {0.5, 2.5, 3}}},
                                     {.title = "Error, mm", .unit = "mm", .decimals = 2})),
            R"svg(<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="560" height="264" viewBox="0 0 560 264" role="img">
<title>Error, mm</title>
<style>text{font-family:system-ui,'DejaVu Sans',sans-serif;fill:#1c2024;font-size:12px}.title{font-size:14px;font-weight:600}.tick{font-size:11px;fill:#5b636c}.grid{stroke:#e0e1de}.lost{fill:#b3261e}.series{fill:none;stroke-width:1.8}.s0{stroke:#0072b2}.s1{stroke:#d55e00;stroke-dasharray:6 3}.s2{stroke:#009e73;stroke-dasharray:2 3}.s3{stroke:#cc79a7;stroke-dasharray:8 3 2 3}.m0{fill:#0072b2}.m1{fill:#d55e00}.m2{fill:#009e73}.m3{fill:#cc79a7}</style>
<rect width="100%" height="100%" fill="#ffffff"/>
<text class="title" x="10" y="19">Error, mm</text>
<g transform="translate(0 26)">
<path class="series s0" d="M10 7.0h26"/>
<circle class="m0" cx="23.0" cy="7.0" r="3.2">
</circle>
<text x="43" y="11">A</text>
<path class="series s1" d="M280 7.0h26"/>
<rect class="m1" x="289.8" y="3.8" width="6.4" height="6.4">
</rect>
<text x="313" y="11">B</text>
<g transform="translate(0 18)">
<line class="grid" x1="62" x2="548" y1="186.0" y2="186.0"/>
<text class="tick" x="56" y="189.5" text-anchor="end">0</text>
<line class="grid" x1="62" x2="548" y1="143.0" y2="143.0"/>
<text class="tick" x="56" y="146.5" text-anchor="end">1</text>
<line class="grid" x1="62" x2="548" y1="100.0" y2="100.0"/>
<text class="tick" x="56" y="103.5" text-anchor="end">2</text>
<line class="grid" x1="62" x2="548" y1="57.0" y2="57.0"/>
<text class="tick" x="56" y="60.5" text-anchor="end">3</text>
<line class="grid" x1="62" x2="548" y1="14.0" y2="14.0"/>
<text class="tick" x="56" y="17.5" text-anchor="end">4</text>
<text class="tick" x="62.0" y="202.0" text-anchor="start">0</text>
<text class="tick" x="548.0" y="202.0" text-anchor="end">2</text>
<path class="series s0" d="M143.0 143.0M467.0 14.0"/>
<path class="series s1" d="M143.0 164.5L305.0 78.5L467.0 57.0"/>
<circle class="m0" cx="143.0" cy="143.0" r="3.4">
<title>frame 0, A: 1.00 mm</title>
</circle>
<circle class="m0" cx="467.0" cy="14.0" r="3.4">
<title>frame 2, A: 4.00 mm</title>
</circle>
<rect class="m1" x="139.6" y="161.1" width="6.8" height="6.8">
<title>frame 0, B: 0.50 mm</title>
</rect>
<rect class="m1" x="301.6" y="75.1" width="6.8" height="6.8">
<title>frame 1, B: 2.50 mm</title>
</rect>
<rect class="m1" x="463.6" y="53.6" width="6.8" height="6.8">
<title>frame 2, B: 3.00 mm</title>
</rect>
<path class="lost" d="M305.0 179.0l4 7h-8z">
<title>frame 1: no mesh</title>
</path>
</g>
</g>
</svg>
)svg");
}

TEST(OverlaidPlot, TheWholePictureOfSharesWithFourLooks) {
  PlotFrames frames = Frames(6);
  EXPECT_EQ(SvgLines(OverlaidPlotSvg(frames,
                                     {{"A", {0.9, 0.91, 0.92, 0.93, 0.94, 0.95}},
                                      {"B", {std::nan(""), 0.8, std::nan(""), 0.8, 0.8, std::nan("")}},
                                      {"C", std::vector<double>(6, 0.85)},
                                      {"D", std::vector<double>(6, std::nan(""))}},
                                     {.title = "Share", .unit = "%", .from_zero = false, .first_style = 3})),
            R"svg(<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="560" height="264" viewBox="0 0 560 264" role="img">
<title>Share</title>
<style>text{font-family:system-ui,'DejaVu Sans',sans-serif;fill:#1c2024;font-size:12px}.title{font-size:14px;font-weight:600}.tick{font-size:11px;fill:#5b636c}.grid{stroke:#e0e1de}.lost{fill:#b3261e}.series{fill:none;stroke-width:1.8}.s0{stroke:#0072b2}.s1{stroke:#d55e00;stroke-dasharray:6 3}.s2{stroke:#009e73;stroke-dasharray:2 3}.s3{stroke:#cc79a7;stroke-dasharray:8 3 2 3}.m0{fill:#0072b2}.m1{fill:#d55e00}.m2{fill:#009e73}.m3{fill:#cc79a7}</style>
<rect width="100%" height="100%" fill="#ffffff"/>
<text class="title" x="10" y="19">Share</text>
<g transform="translate(0 26)">
<path class="series s3" d="M10 7.0h26"/>
<path class="m3" d="M23.0 2.8l4.2 4.2l-4.2 4.2l-4.2 -4.2z">
</path>
<text x="43" y="11">A</text>
<path class="series s0" d="M145 7.0h26"/>
<circle class="m0" cx="158.0" cy="7.0" r="3.2">
</circle>
<text x="178" y="11">B</text>
<path class="series s1" d="M280 7.0h26"/>
<rect class="m1" x="289.8" y="3.8" width="6.4" height="6.4">
</rect>
<text x="313" y="11">C</text>
<path class="series s2" d="M415 7.0h26"/>
<path class="m2" d="M428.0 3.2l3.8 6.7h-7.7z">
</path>
<text x="448" y="11">D</text>
<g transform="translate(0 18)">
<line class="grid" x1="62" x2="548" y1="186.0" y2="186.0"/>
<text class="tick" x="56" y="189.5" text-anchor="end">70 %</text>
<line class="grid" x1="62" x2="548" y1="128.7" y2="128.7"/>
<text class="tick" x="56" y="132.2" text-anchor="end">80 %</text>
<line class="grid" x1="62" x2="548" y1="71.3" y2="71.3"/>
<text class="tick" x="56" y="74.8" text-anchor="end">90 %</text>
<line class="grid" x1="62" x2="548" y1="14.0" y2="14.0"/>
<text class="tick" x="56" y="17.5" text-anchor="end">100 %</text>
<text class="tick" x="62.0" y="202.0" text-anchor="start">0</text>
<text class="tick" x="345.5" y="202.0" text-anchor="middle">3</text>
<text class="tick" x="548.0" y="202.0" text-anchor="end">5</text>
<path class="series s3" d="M102.5 71.3L183.5 65.6L264.5 59.9L345.5 54.1L426.5 48.4L507.5 42.7"/>
<path class="series s0" d="M183.5 128.7M345.5 128.7L426.5 128.7"/>
<path class="series s1" d="M102.5 100.0L183.5 100.0L264.5 100.0L345.5 100.0L426.5 100.0L507.5 100.0"/>
<path class="series s2" d=""/>
<path class="m3" d="M102.5 66.9l4.4 4.4l-4.4 4.4l-4.4 -4.4z">
<title>frame 0, A: 90.0 %</title>
</path>
<path class="m3" d="M183.5 61.2l4.4 4.4l-4.4 4.4l-4.4 -4.4z">
<title>frame 1, A: 91.0 %</title>
</path>
<path class="m3" d="M264.5 55.4l4.4 4.4l-4.4 4.4l-4.4 -4.4z">
<title>frame 2, A: 92.0 %</title>
</path>
<path class="m3" d="M345.5 49.7l4.4 4.4l-4.4 4.4l-4.4 -4.4z">
<title>frame 3, A: 93.0 %</title>
</path>
<path class="m3" d="M426.5 44.0l4.4 4.4l-4.4 4.4l-4.4 -4.4z">
<title>frame 4, A: 94.0 %</title>
</path>
<path class="m3" d="M507.5 38.2l4.4 4.4l-4.4 4.4l-4.4 -4.4z">
<title>frame 5, A: 95.0 %</title>
</path>
<circle class="m0" cx="183.5" cy="128.7" r="3.4">
<title>frame 1, B: 80.0 %</title>
</circle>
<circle class="m0" cx="345.5" cy="128.7" r="3.4">
<title>frame 3, B: 80.0 %</title>
</circle>
<circle class="m0" cx="426.5" cy="128.7" r="3.4">
<title>frame 4, B: 80.0 %</title>
</circle>
<rect class="m1" x="99.1" y="96.6" width="6.8" height="6.8">
<title>frame 0, C: 85.0 %</title>
</rect>
<rect class="m1" x="180.1" y="96.6" width="6.8" height="6.8">
<title>frame 1, C: 85.0 %</title>
</rect>
<rect class="m1" x="261.1" y="96.6" width="6.8" height="6.8">
<title>frame 2, C: 85.0 %</title>
</rect>
<rect class="m1" x="342.1" y="96.6" width="6.8" height="6.8">
<title>frame 3, C: 85.0 %</title>
</rect>
<rect class="m1" x="423.1" y="96.6" width="6.8" height="6.8">
<title>frame 4, C: 85.0 %</title>
</rect>
<rect class="m1" x="504.1" y="96.6" width="6.8" height="6.8">
<title>frame 5, C: 85.0 %</title>
</rect>
</g>
</g>
</svg>
)svg");
}

// Labels of the values' axis.
std::string LabelsOf(double low, double high, const PlotText& text) {
  const std::string svg = OverlaidPlotSvg(Frames(2), {{"A", {low, high}}}, text),
                    begin = "text-anchor=\"end\">";
  std::string labels;
  for (size_t at = svg.find(begin); at != std::string::npos; at = svg.find(begin, at + 1)) {
    const size_t start = at + begin.size();
    labels += (labels.empty() ? "" : " ") + svg.substr(start, svg.find('<', start) - start);
  }
  return labels.substr(0, labels.rfind(' '));  // the last one is a frame's name
}

TEST(OverlaidPlot, TicksAreRoundNumbersAroundTheValues) {
  const PlotText near{.from_zero = false};
  EXPECT_EQ(LabelsOf(0, 4, near), "0 1 2 3 4");
  EXPECT_EQ(LabelsOf(0, 4.1, near), "0 2 4 6");
  EXPECT_EQ(LabelsOf(0, 10, near), "0.0 2.5 5.0 7.5 10.0");
  EXPECT_EQ(LabelsOf(1, 19, near), "0 5 10 15 20");
  EXPECT_EQ(LabelsOf(0, 3000, near), "0 1,000 2,000 3,000");
  EXPECT_EQ(LabelsOf(3, 3, near), "3 4 5 6");
  EXPECT_EQ(LabelsOf(0, 0, near), "0.00 0.25 0.50 0.75 1.00");
  EXPECT_EQ(LabelsOf(-0.002, 0.002, near), "\u22120.002 \u22120.001 0.000 0.001 0.002");
  EXPECT_EQ(LabelsOf(3, 4, {}), "0 1 2 3 4");
  EXPECT_EQ(LabelsOf(-3, 4, {}), "\u22124 \u22122 0 2 4");
}

TEST(OverlaidPlot, ManyFramesHaveSmallPoints) {
  const auto radii = [](size_t frames) {
    std::string found;
    const std::string svg = OverlaidPlotSvg(Frames(frames), {{"A", std::vector<double>(frames, 1)}}, {});
    for (size_t at = svg.find("cx="); at != std::string::npos; at = svg.find("cx=", at + 1)) {
      const size_t r = svg.find(" r=\"", at) + 4;
      const std::string radius = svg.substr(r, svg.find('"', r) - r);
      if (found.find(radius) == std::string::npos) found += radius + " ";
    }
    return found;
  };
  EXPECT_EQ(radii(2), "3.2 3.4 ");
  EXPECT_EQ(radii(60), "3.2 2.4 ");
  EXPECT_EQ(radii(61), "3.2 1.1 ");
  EXPECT_EQ(radii(120), "3.2 1.1 ");
  EXPECT_EQ(radii(121), "3.2 1.1 ") << "61 bins of two frames";
  EXPECT_EQ(radii(240), "3.2 1.1 ");
}

TEST(OverlaidPlot, BinsAreMeansOfTheirFrames) {
  PlotFrames frames = Frames(121);
  frames.without_mesh[2] = frames.without_mesh[3] = frames.without_mesh[120] = true;
  std::vector<double> values(121, 1);
  values[0] = 4, values[1] = std::nan(""), values[120] = 7;
  const std::string svg = OverlaidPlotSvg(frames, {{"A", values}}, {});
  for (const char* text : {"frames 0 to 1, A: 4<", "frames 2 to 3, A: 1<", "frame 120, A: 7<",
                           "frames 2 to 3: 2 without mesh<", "frame 120: no mesh<", ">60</text>"})
    EXPECT_THAT(svg, HasSubstr(text));
}

}  // namespace
}  // namespace weft
