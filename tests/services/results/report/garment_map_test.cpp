#include "services/results/report/garment_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace weft
