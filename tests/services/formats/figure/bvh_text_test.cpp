#include "services/formats/figure/bvh_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(BvhText, BracesAndColonsAreWords) {
  BvhText text("\xEF\xBB\xBF ROOT{Frames:2}");
  for (const char* word : {"ROOT", "{", "Frames", ":", "2", "}", ""}) EXPECT_EQ(text.Next(), word);
  EXPECT_TRUE(text.AtEnd());
}

TEST(BvhText, LinesEndInThreeWays) {
  BvhText text("a\r\nb\rc\nd");
  text.Next();
  EXPECT_EQ(text.Line(), 2u);
  EXPECT_EQ(text.LineBefore(), 1u);
  text.Next();
  EXPECT_EQ(text.Line(), 3u);
  text.Next();
  EXPECT_EQ(text.Line(), 4u);
}

TEST(BvhText, NamesMayHaveBlanks) {
  BvhText text("ROOT left arm \t{\n");
  EXPECT_TRUE(text.Take("root"));
  EXPECT_EQ(text.RestOfLine(), "left arm");
  EXPECT_EQ(text.Peek(), "{");
  EXPECT_FALSE(text.Take("}"));
  EXPECT_THAT(std::string(text.Expect("offset").message()),
              HasSubstr("line 1: expected offset, found \"{\""));
}

TEST(BvhText, NumbersAreFiniteAndHaveAPoint) {
  BvhText text("+1.5 -2e3 1e-999 1E-999");
  for (const double expected : {1.5, -2000.0, 0.0, 0.0}) {
    const auto number = text.Number("an angle");
    ASSERT_TRUE(number.ok()) << number.status();
    EXPECT_EQ(*number, expected);
  }
  EXPECT_THAT(std::string(text.Number("an angle").status().message()), HasSubstr("was the file truncated?"));
  EXPECT_THAT(std::string(BvhText("1,5").Number("an angle").status().message()), HasSubstr("has a comma"));
  EXPECT_THAT(BvhText("1.5x").Number("an angle").status().message(),
              HasSubstr("is no number, expected an angle"));
  for (const char* signs : {"+-5", "-+5", "++5", "--5"})
    EXPECT_FALSE(BvhText(signs).Number("an angle").ok()) << signs;
  EXPECT_THAT(BvhText("\n\ninf").Number("an angle").status().message(),
              HasSubstr("line 3: \"inf\" is no finite"));
}

}  // namespace
}  // namespace weft
