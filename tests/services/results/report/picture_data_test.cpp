#include "services/results/report/picture_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/results/report/proto_text.h"

namespace weft {
namespace {

TEST(PictureData, ScalesRunFromEndToEnd) {
  const v1::PageScale open = ScaleKey({0, 0.5}, "sigma", "mm").scale();
  EXPECT_EQ(open.label(), "sigma");
  EXPECT_EQ(open.unit(), "mm");
  EXPECT_DOUBLE_EQ(open.high(), 0.5);
  EXPECT_FALSE(open.bounded());
  EXPECT_EQ(open.colors(0), HexColor(MapColor(0)));
  EXPECT_EQ(open.colors(open.colors_size() - 1), HexColor(MapColor(1)));
  EXPECT_TRUE(ScaleKey({0, 0.5}, "sigma", "mm", true).scale().bounded());
}

TEST(PictureData, DifferencesRunFromBlueToOrange) {
  const v1::PageScale scale = ScaleKey({-2, 2}, "", "").scale();
  EXPECT_EQ(scale.colors(0), "#2a60a8");
  EXPECT_EQ(scale.colors(scale.colors_size() / 2), "#f4f4f0");
  EXPECT_EQ(scale.colors(scale.colors_size() - 1), "#de7e18");
}

TEST(PictureData, KeysNameTheStatesAskedFor) {
  const v1::PageKey key = StateKey({VertexState::kTwoView, VertexState::kDriven});
  ASSERT_EQ(key.entries_size(), 2);
  EXPECT_EQ(key.entries(0).meaning(), "measured by two cameras only");
  EXPECT_EQ(key.entries(0).color(), HexColor(StateColor(VertexState::kTwoView)));
  EXPECT_EQ(key.entries(1).meaning(), "driven: by the garment's avatar and at most one camera");
  EXPECT_FALSE(key.has_scale());
}

TEST(PictureData, PicturesKeepTheirBytes) {
  const v1::PagePicture picture = PictureData({"Front", "\x89PNG", 4, 3});
  EXPECT_EQ(picture.title() + picture.type(), "Frontimage/png");
  EXPECT_EQ(picture.bytes(), "\x89PNG");
  EXPECT_EQ(picture.width_px() * 10 + picture.height_px(), 43);
}

TEST(PictureData, EachStateHasItsMeaning) {
  using enum VertexState;
  EXPECT_EQ(
      StateKey({kObserved, kTwoView, kInferred, kBridged, kDriven}).DebugString(),
      TextOf<v1::PageKey>(
          R"(entries { color: "#57b5e8" meaning: "observed: measured in this frame" } entries { color: "#009e73"
meaning: "measured by two cameras only" } entries { color: "#e69e00" meaning:
"inferred from the cloth around it" } entries { color: "#8c4080" meaning:
"bridged: from the frames around" } entries { color: "#f0e342" meaning:
"driven: by the garment\'s avatar and at most one camera" })"));
}

TEST(PictureData, ScalesHaveSeventeenColours) {
  const v1::PageScale scale = ScaleKey({0, 4}, "a", "b").scale();
  ASSERT_EQ(scale.colors_size(), 17);
  EXPECT_EQ(scale.colors(4), HexColor(MapColor(0.25)));
  EXPECT_EQ(scale.low(), 0);
}

}  // namespace
}  // namespace weft
