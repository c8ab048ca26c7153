#include "services/results/report/picture_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace weft
