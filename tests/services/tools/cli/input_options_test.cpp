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

}  // namespace
}  // namespace weft
