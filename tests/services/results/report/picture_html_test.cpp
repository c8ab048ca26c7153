#include "services/results/report/picture_html.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(PictureHtml, ColourBarsSayWhereTheyAreOpen) {
  const std::string open = ColorBar({0, 0.5}, "sigma", "mm");
  EXPECT_THAT(open, HasSubstr("<span>sigma 0 mm</span>"));
  EXPECT_THAT(open, HasSubstr("<span>0.5 mm and more</span>"));
  EXPECT_THAT(ColorBar({0, 0.5}, "sigma", "mm", true), HasSubstr("<span>0.5 mm</span>"));
}

TEST(PictureHtml, DifferencesRunFromBlueToOrange) {
  const std::string html = ColorBar({-2, 2}, "A<B", "");
  EXPECT_THAT(html, HasSubstr("<span>A&lt;B \xE2\x88\x92"
                              "2 and less</span>"));
  EXPECT_THAT(html, HasSubstr("<span>+2 and more</span>"));
  EXPECT_THAT(html, HasSubstr("(90deg,#2a60a8 0.0%,"));
  EXPECT_THAT(html, HasSubstr(",#f4f4f0 50.0%,"));
  EXPECT_THAT(html, HasSubstr(",#de7e18 100.0%)"));
}

TEST(PictureHtml, SharesAreShownAsPercent) {
  const GarmentMap map = ShareMap("Title", "label", {0.25, 1});
  EXPECT_THAT(map.values, ElementsAre(25, 100));
  EXPECT_EQ(map.unit, "%");
  EXPECT_DOUBLE_EQ(map.range.high, 100);
}

TEST(PictureHtml, PicturesSayWhatTheyShow) {
  EXPECT_EQ(PictureRow({}, "frame 1", "state", "legend"), "");
  const std::string html = PictureRow({{"Front", "foob", 4, 3}}, "frame <1>", "state", "<p>legend</p>");
  EXPECT_THAT(html, HasSubstr("width=\"4\" height=\"3\" alt=\"Front of frame &lt;1&gt;, coloured by state\" "
                              "src=\"data:image/png;base64,Zm9vYg==\""));
  EXPECT_THAT(PictureRow({{"Front", "foob", 4, 3}}, "frame 1", "", ""), Not(HasSubstr("coloured by")));
}

TEST(PictureHtml, LegendsNameTheStatesAskedFor) {
  const std::string html = StateLegend({VertexState::kTwoView});
  EXPECT_THAT(html, HasSubstr("measured by two cameras only"));
  EXPECT_THAT(html, Not(HasSubstr("inferred")));
}

}  // namespace
}  // namespace weft
