#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/results/report/report_sections.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(PictureSection, FramesWithoutPicturesAreLeftOut) {
  EXPECT_EQ(PictureSection({}), "");
  EXPECT_EQ(PictureSection({{.frame = "1"}}), "");
}

TEST(PictureSection, DrivenMeshesHaveALegendOfTheirOwn) {
  FramePictures frame{.frame = "<1>", .why_shown = "first frame", .by_state = {{"Front", "x", 4, 3}}};
  const std::string registered = PictureSection({frame});
  EXPECT_THAT(registered, HasSubstr("<h3>Frame <bdi>&lt;1&gt;</bdi> <small>first frame</small></h3>"));
  EXPECT_THAT(registered, HasSubstr("inferred from the cloth around it"));
  frame.is_driven = true;
  EXPECT_THAT(PictureSection({frame}), HasSubstr("driven: by the garment's avatar"));
  EXPECT_THAT(PictureSection({frame}), Not(HasSubstr("inferred")));
}

TEST(PictureSection, ImagesOfFramesThatFailedAreShownAlone) {
  FramePictures frame{.frame = "1", .in_images = {{"c01", "x", 4, 3, "image/jpeg"}}};
  EXPECT_THAT(PictureSection({frame}), HasSubstr("the frame could not be registered"));
  frame.by_state = {{"Front", "x", 4, 3}};
  EXPECT_THAT(PictureSection({frame}), HasSubstr("c01 of frame 1 with the mesh over it"));
}

}  // namespace
}  // namespace weft
