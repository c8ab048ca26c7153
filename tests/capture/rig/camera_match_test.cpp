#include "capture/rig/camera_match.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(CameraNames, AreFoundButForTheCaseWhereOneAloneFits) {
  const CameraNames names({"Left", "right", "RIGHT"});
  EXPECT_EQ(names.Find("Left"), 0);
  EXPECT_EQ(names.Find("left"), 0);
  EXPECT_EQ(names.Find("RIGHT"), 2);
  EXPECT_EQ(names.Find("Right"), -1);
  EXPECT_EQ(names.Find("middle"), -1);
}

// Systems write one letter, or a letter and its accent.
TEST(CameraNames, AreFoundAsUnicodeComparesThem) {
  EXPECT_EQ(CameraNames({"a", "M\xc3\xa4nnchen"}).Find("Ma\xcc\x88nnchen"), 1);
}

TEST(CameraMatch, NamesEightAndCountsTheRest) {
  std::vector<std::string> names;
  for (int i = 1; i <= 10; ++i) names.push_back("c" + std::to_string(i));
  EXPECT_EQ(FirstNames(names), "c1, c2, c3, c4, c5, c6, c7, c8 and 2 more");
  names.resize(8);
  EXPECT_EQ(FirstNames(names), "c1, c2, c3, c4, c5, c6, c7, c8");
}

TEST(CameraMatch, WarnsOfCamerasThatOneSideHas) {
  CameraMatch match{3, 3, {}, {}};
  EXPECT_THAT(CameraWarnings(match, "/take"), IsEmpty());
  match.without_images = {"left"};
  EXPECT_THAT(CameraWarnings(match, "/take"), ElementsAre("camera left of the rig has no images in /take"));
  match.without_images = {"left", "right"};
  EXPECT_THAT(CameraWarnings(match, "/take"),
              ElementsAre("2 of 3 cameras of the rig have no images in /take: left, right"));
  match = {3, 4, {}, {"top"}};
  EXPECT_THAT(CameraWarnings(match, "/take"),
              ElementsAre("1 of 4 cameras of /take is not in the rig: top; is it the rig of this take?"));
}

TEST(CameraMatch, TellsOfNamesThatDifferInZerosAlone) {
  EXPECT_THAT(CameraWarnings({1, 1, {"c01"}, {"c1"}}, "/take"),
              ElementsAre(HasSubstr("c01"), HasSubstr("c1"), HasSubstr("in zeros alone: c01 is c1 there")));
}

}  // namespace
}  // namespace weft
