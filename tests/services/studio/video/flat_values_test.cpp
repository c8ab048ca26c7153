#include "services/studio/video/flat_values.h"

#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

TEST(FlatValues, AreReadAsFfprobePrintsThem) {
  const FlatValues values = ValuesOf(
      "streams.stream.0.width=1920\n"
      "streams.stream.0.tags.TIMECODE=\"10:22:33:12\"\n"
      "format.filename=\"a \\\"b\\\" = c\"\n"
      "no value\n"
      "streams.stream.0.nb_frames=\"N/A\"\n");
  EXPECT_EQ(values.size(), 4u);
  EXPECT_EQ(IntegerOf(values, "streams.stream.0.width"), 1920);
  EXPECT_EQ(ValueOf(values, "streams.stream.0.tags.timecode"), "10:22:33:12");
  EXPECT_EQ(ValueOf(values, "format.filename"), "a \"b\" = c");
  EXPECT_EQ(ValueOf(values, "streams.stream.0.nb_frames"), "");
  EXPECT_EQ(ValueOf(values, "missing"), "");
  EXPECT_EQ(IntegerOf(values, "streams.stream.0.tags.timecode"), 0);
}

TEST(FlatValues, LeaveOutLinesOfStrangeLength) {
  EXPECT_TRUE(ValuesOf("a=" + std::string(999, 'x')).empty());
  EXPECT_EQ(ValuesOf("a=" + std::string(998, 'x')).size(), 1u);
  EXPECT_TRUE(ValuesOf("").empty());
}

TEST(FlatValues, HaveFractionsOfPositiveNumbers) {
  EXPECT_EQ(FractionOf("30000/1001"), std::pair(int64_t{30000}, int64_t{1001}));
  for (const char* text : {"", "30", "0/1", "1/0", "-1/1", "1/1/1", "a/b", "2147483648/1", "1/2147483648"})
    EXPECT_FALSE(FractionOf(text)) << text;
  EXPECT_TRUE(FractionOf("2147483647/1"));
}

}  // namespace
}  // namespace weft
