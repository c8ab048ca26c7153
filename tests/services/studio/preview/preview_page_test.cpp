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

}  // namespace
}  // namespace weft
