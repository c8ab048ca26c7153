#include "services/studio/preview/preview_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

PreviewCamera Camera(const std::string& id) {
  PreviewCamera camera;
  camera.id = id;
  camera.thumbnail = {id, 1, 1, PixelFormat::kRgb8, std::make_shared<const std::vector<uint8_t>>(3, 90),
                      0,  ""};
  camera.quality.low = 20;
  camera.quality.middle = 100;
  camera.quality.high = 200;
  camera.quality.focus = camera.best_focus = 0.1;
  return camera;
}

TEST(PreviewPage, SaysWhatIsWrongWithACamera) {
  PreviewCamera camera = Camera("c1");
  EXPECT_EQ(PictureFault(camera), "");
  camera.quality.focus = 0.05;
  EXPECT_EQ(PictureFault(camera), "less sharp than before");
  camera.quality.high = 40;
  EXPECT_EQ(PictureFault(camera), "too dark");
  camera.quality.clipped_share = 0.03;  // a lamp in the picture, but too much on the cloth
  EXPECT_EQ(PictureFault(camera), "too dark");
  camera.is_cloth = true;
  EXPECT_EQ(PictureFault(camera), "overexposed");
  camera.thumbnail.pixels = nullptr;
  camera.missing = "5 packets lost";
  EXPECT_EQ(PictureFault(camera), "no picture: 5 packets lost");
}

TEST(PreviewPage, PutsWhatNeedsAttentionFirst) {
  PreviewPage page;
  page.title = "walk <1>";
  page.state = "12 s, 360 sets";
  page.set = 41;
  page.cameras = {Camera("c1"), Camera("c<2>")};
  EXPECT_THAT(PreviewHtml(page),
              AllOf(HasSubstr("walk &lt;1&gt;"), HasSubstr("frame set 41"), HasSubstr("12 s, 360 sets"),
                    HasSubstr("http-equiv=refresh"), Not(HasSubstr("to check")), Not(HasSubstr("c<2>"))));
  page.cameras[1].quality.high = 10;
  page.is_over = true;
  const std::string html = PreviewHtml(page);
  EXPECT_THAT(html, AllOf(HasSubstr("1 of 2 cameras to check"), Not(HasSubstr("http-equiv=refresh"))));
  EXPECT_LT(html.find("too dark"), html.find("<figure"));
}

TEST(PreviewPage, ShowsACameraAloneWithBarsToTurnALensBy) {
  PreviewPage page;
  page.cameras = {Camera("c1")};
  page.cameras[0].quality.focus = 0.087;
  const std::string html = PreviewHtml(page);
  EXPECT_THAT(html, AllOf(HasSubstr("<figure id=\"camera-c1\""), HasSubstr("href=\"#camera-c1\""),
                          HasSubstr("class=\"meter focus\""), HasSubstr("87&nbsp;% <small>of best"),
                          HasSubstr("page not updated for")));
}

TEST(PreviewPage, FaultsBeginBeyondTheirLimits) {
  PreviewCamera camera = Camera("c1");
  camera.quality.clipped_share = 0.06;
  EXPECT_EQ(PictureFault(camera), "");
  camera.quality.clipped_share = 0.061;
  EXPECT_EQ(PictureFault(camera), "overexposed");
  camera.is_cloth = true;
  camera.quality.clipped_share = 0.01;
  EXPECT_EQ(PictureFault(camera), "");
  camera.quality.clipped_share = 0.011;
  EXPECT_EQ(PictureFault(camera), "overexposed");
  camera.quality.clipped_share = 0;
  camera.quality.high = 80;
  EXPECT_EQ(PictureFault(camera), "");
  camera.quality.high = 79;
  EXPECT_EQ(PictureFault(camera), "too dark");
  camera.quality.high = 80;
  camera.quality.focus = 0.061;
  EXPECT_EQ(PictureFault(camera), "");
  camera.quality.focus = 0.059;
  EXPECT_EQ(PictureFault(camera), "less sharp than before");
}

TEST(PreviewPage, BarsAreSharesOfTheirRails) {
  PreviewPage page;
  page.cameras = {Camera("c1")};
  PreviewCamera& camera = page.cameras[0];
  camera.quality.low = 51;
  camera.quality.middle = 102;
  camera.quality.high = 204;
  camera.quality.clipped_share = 0.0123;
  camera.quality.focus = 0.096;
  EXPECT_THAT(
      PreviewHtml(page),
      AllOf(HasSubstr("<i style=\"left:20.0%;width:60.0%\"></i><i class=mid style=\"left:40.0%\"></i>"),
            HasSubstr("1.2&nbsp;% <small>white"), HasSubstr("<i style=\"left:0.0%;width:96.0%\"></i>"),
            Not(HasSubstr("cells read"))));
  camera.quality.focus = 0.0975;
  camera.cells = 1234;
  EXPECT_THAT(PreviewHtml(page), AllOf(HasSubstr("<i class=full style=\"left:0.0%;width:97.5%\"></i>"),
                                       HasSubstr("cells read</span><em>1,234")));
  // A bar is always to be seen; nothing is known of the best focus.
  camera.best_focus = 0;
  EXPECT_THAT(PreviewHtml(page), HasSubstr("<i style=\"left:0.0%;width:1.0%\"></i>"));
}

TEST(PreviewPage, SaysWhenNobodyRenewsIt) {
  PreviewPage page;
  page.refresh_s = 2;
  page.made_unix_ms = 1234;
  EXPECT_THAT(PreviewHtml(page), AllOf(HasSubstr("const made = 1234, limit = 11.0, over = false;"),
                                       HasSubstr("http-equiv=refresh content=\"2.0\""),
                                       HasSubstr("no frame set yet"), HasSubstr(">live</span>")));
  page.is_over = true;
  page.set = 7;
  page.passed_over = 3;
  EXPECT_THAT(PreviewHtml(page),
              AllOf(HasSubstr("over = true;"), HasSubstr("<body class=over>"), HasSubstr(">over</span>"),
                    HasSubstr("frame set 7"), HasSubstr("3 skipped since the page before")));
}

TEST(PreviewPage, CoverageIsTheShareOfThreeCamerasOrMore) {
  PreviewPage page;
  page.cameras = {Camera("c1"), Camera("c2")};
  EXPECT_THAT(PreviewHtml(page), Not(HasSubstr("<h2>Coverage")));
  page.coverage.emplace();
  page.coverage->cells = {100, 200, 300, 150, 250};
  page.coverage->cameras = 1;
  EXPECT_THAT(
      PreviewHtml(page),
      AllOf(HasSubstr("of 1,000 cells are read by three cameras or more; 1 of 2 cameras decoded so far"),
            HasSubstr("<div class=share>40"), HasSubstr("width:25.00%"), HasSubstr("width:10.00%")));
  page.coverage->cells = {};
  EXPECT_THAT(PreviewHtml(page), HasSubstr("width:0.00%"));
}

TEST(PreviewPage, ACameraWithoutPictureSaysWhy) {
  PreviewPage page;
  page.cameras = {Camera("c1")};
  page.cameras[0].thumbnail.pixels = nullptr;
  page.cameras[0].missing = "5 packets <lost>";
  EXPECT_THAT(PreviewHtml(page), AllOf(HasSubstr("no picture</div>"), HasSubstr("5 packets &lt;lost&gt;"),
                                       HasSubstr("class=faulty"), HasSubstr("1 of 1 camera to check")));
}

}  // namespace
}  // namespace weft
