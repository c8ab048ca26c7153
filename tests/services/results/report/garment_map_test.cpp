#include "services/results/report/garment_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/results/report/svg_lines.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

const TriangleMesh kTriangle{{{0, 0, 0}, {100, 0, 0}, {0, 100, 1}}, {{0, 1, 2}}};

TEST(GarmentMap, SharesAreShownAsPercent) {
  const GarmentMap map = ShareMap("Title", "label", {0.25, 1});
  EXPECT_THAT(map.values, ElementsAre(25, 100));
  EXPECT_EQ(map.unit, "%");
  EXPECT_DOUBLE_EQ(map.range.high, 100);
}

// Values beyond the range leave the scale open.
TEST(GarmentMap, SaysWhetherItsScaleIsBounded) {
  GarmentMap map{"Vertex error", "error", "mm", {0, 1, 2}, {0, 2}};
  const v1::PageMap data = GarmentMapData(kTriangle, map).value();
  EXPECT_EQ(data.title(), "Vertex error");
  ASSERT_EQ(data.pictures_size(), 2);
  EXPECT_EQ(data.pictures(1).title(), "Back");
  EXPECT_TRUE(data.key().scale().bounded());
  map.values[1] = 3;
  EXPECT_FALSE(GarmentMapData(kTriangle, map).value().key().scale().bounded());
}

TEST(GarmentMap, FilesSayWhereTheirScaleIsOpen) {
  const std::string open = GarmentMapSvg(kTriangle, {"A<B", "sigma", "mm", {0, 1, 0.25}, {0, 0.5}}).value();
  EXPECT_THAT(open, HasSubstr("<title>A&lt;B</title>"));
  EXPECT_THAT(open, HasSubstr(">0 mm</text>"));
  EXPECT_THAT(open, HasSubstr(">0.5 mm and more</text>"));
  EXPECT_THAT(open, HasSubstr("href=\"data:image/png;base64,"));
  const std::string bounded =
      GarmentMapSvg(kTriangle, {"A", "sigma", "mm", {0, 0.5, 0.25}, {0, 0.5}}).value();
  EXPECT_THAT(bounded, HasSubstr(">0.5 mm</text>"));
  EXPECT_THAT(bounded, Not(HasSubstr("and more")));
}

TEST(GarmentMap, DifferencesInFilesRunFromBlueToOrange) {
  const std::string svg = GarmentMapSvg(kTriangle, {"A", "A minus B", "", {-3, 3, 0}, {-2, 2}}).value();
  EXPECT_THAT(svg, HasSubstr(">\xE2\x88\x92"
                             "2 and less</text>"));
  EXPECT_THAT(svg, HasSubstr(">+2 and more</text>"));
  EXPECT_THAT(svg, HasSubstr("offset=\"0.0%\" stop-color=\"#2a60a8\""));
  EXPECT_THAT(svg, HasSubstr("offset=\"50.0%\" stop-color=\"#f4f4f0\""));
  EXPECT_THAT(svg, HasSubstr("offset=\"100.0%\" stop-color=\"#de7e18\""));
}

// Without the bytes of its pictures.
std::string WithoutPictures(std::string svg) {
  const std::string begin = "base64,";
  for (size_t at = svg.find(begin); at != std::string::npos; at = svg.find(begin, at + 1))
    svg.erase(at + begin.size(), svg.find('"', at) - at - begin.size());
  return svg;
}

TEST(GarmentMap, TheWholeFileIsTheScaleAndBothSides) {
  EXPECT_EQ(SvgLines(WithoutPictures(
                GarmentMapSvg(kTriangle, {"A & B", "a<b", "mm", {0, 1, 0.25}, {0, 0.5}}).value())),
            R"svg(<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="1010" height="596" viewBox="0 0 1010 596" role="img">
<title>A &amp; B</title>
<style>text{font-family:system-ui,'DejaVu Sans',sans-serif;fill:#1c2024;font-size:12px}.title{font-size:14px;font-weight:600}.tick{font-size:11px;fill:#5b636c}.grid{stroke:#e0e1de}.lost{fill:#b3261e}.series{fill:none;stroke-width:1.8}.s0{stroke:#0072b2}.s1{stroke:#d55e00;stroke-dasharray:6 3}.s2{stroke:#009e73;stroke-dasharray:2 3}.s3{stroke:#cc79a7;stroke-dasharray:8 3 2 3}.m0{fill:#0072b2}.m1{fill:#d55e00}.m2{fill:#009e73}.m3{fill:#cc79a7}</style>
<rect width="100%" height="100%" fill="#ffffff"/>
<text class="title" x="10" y="19">A &amp; B</text>
<g transform="translate(0 26)">
<defs>
<linearGradient id="scale">
<stop offset="0.0%" stop-color="#39346b"/>
<stop offset="6.2%" stop-color="#374177"/>
<stop offset="12.5%" stop-color="#334e82"/>
<stop offset="18.8%" stop-color="#2e5b8b"/>
<stop offset="25.0%" stop-color="#276992"/>
<stop offset="31.2%" stop-color="#1f7697"/>
<stop offset="37.5%" stop-color="#19839b"/>
<stop offset="43.8%" stop-color="#1a919d"/>
<stop offset="50.0%" stop-color="#259d9d"/>
<stop offset="56.2%" stop-color="#36aa9c"/>
<stop offset="62.5%" stop-color="#4ab598"/>
<stop offset="68.8%" stop-color="#61c093"/>
<stop offset="75.0%" stop-color="#7acb8c"/>
<stop offset="81.2%" stop-color="#95d483"/>
<stop offset="87.5%" stop-color="#b2dc78"/>
<stop offset="93.8%" stop-color="#d1e26b"/>
<stop offset="100.0%" stop-color="#f1e75c"/>
</linearGradient>
</defs>
<text x="10" y="14">a&lt;b</text>
<rect x="90" y="4" width="220" height="11" fill="url(#scale)"/>
<text class="tick" x="90" y="29">0 mm</text>
<text class="tick" x="310" y="29" text-anchor="end">0.5 mm and more</text>
<image x="10" y="40" width="480" height="508" href="data:image/png;base64,"/>
<text class="tick" x="250" y="562" text-anchor="middle">Front</text>
<image x="510" y="40" width="480" height="508" href="data:image/png;base64,"/>
<text class="tick" x="750" y="562" text-anchor="middle">Back</text>
</g>
</svg>
)svg");
}

TEST(GarmentMap, ScalesAreOpenOnTheSideThatAValueExceeds) {
  const auto ends = [](double low, double high) {
    const std::string svg = GarmentMapSvg(kTriangle, {"", "", "", {low, high, 0}, {-2, 2}}).value();
    return svg.find("and more") != std::string::npos;
  };
  EXPECT_FALSE(ends(-2, 2));
  EXPECT_TRUE(ends(-2, 2.5));
  EXPECT_TRUE(ends(-2.5, 2));
  GarmentMap from_zero{"", "", "", {-1, 1, 2}, {0, 2}};
  EXPECT_TRUE(GarmentMapData(kTriangle, from_zero).value().key().scale().bounded());
}

}  // namespace
}  // namespace weft
