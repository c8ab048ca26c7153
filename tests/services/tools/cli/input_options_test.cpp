#include "services/tools/cli/input_options.h"

#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

TEST(InputOptions, ReadFramesByTheirOldNameToo) {
  CLI::App app;
  std::string frames;
  AddFramesOption(app, frames, "Frames to look at", "--frame");
  app.parse("--frames 0003:0010");
  EXPECT_EQ(frames, "0003:0010");
  app.clear();
  app.parse("--frame 0007");
  EXPECT_EQ(frames, "0007");
  app.clear();
  EXPECT_THROW(app.parse("--frame 1 --frames 2"), CLI::ExcludesError);
}

TEST(InputOptions, ExplainThemselves) {
  CLI::App app;
  std::string frames, mosaic;
  AddFramesOption(app, frames, "Frames to look at", "--frame");
  AddMosaicOption(app, mosaic);
  EXPECT_EQ(app.get_option("--frames")->get_description(),
            "Frames to look at: a frame by its name, 0003, or a range A:B, B not included; either side may "
            "be left out");
  EXPECT_EQ(app.get_option("--frames")->get_type_name(), "RANGE");
  EXPECT_EQ(app.help().find("--frame "), std::string::npos) << "the old name is not shown";
  app.parse("--mosaic bayer_gb8");
  EXPECT_EQ(mosaic, "bayer_gb8");
  CLI::App other;
  AddFramesOption(other, frames, "Frames to look at");
  EXPECT_THROW(other.parse("--frame 1"), CLI::ParseError);
}

}  // namespace
}  // namespace weft
