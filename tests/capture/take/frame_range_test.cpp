#include "capture/take/frame_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

using FrameNames = std::vector<std::string>;

// "first:end" of the positions, or the error.
std::string Found(const std::string& text, const FrameNames& names) {
  const auto range = FindFrameRange(text, names, "DUMP");
  return range.ok() ? std::to_string(range->first) + ":" + std::to_string(range->end)
                    : std::string(range.status().message());
}

TEST(FrameRange, FindsFramesByName) {
  const FrameNames names = {"0007", "0008", "0009", "0012", "0013"};
  EXPECT_EQ(Found("", names), "0:5");
  EXPECT_EQ(Found("0008", names), "1:2");
  EXPECT_EQ(Found("8", names), "1:2");
  EXPECT_EQ(Found("0008:0012", names), "1:3");
  EXPECT_EQ(Found("8:11", names), "1:3");  // a number in a range need not occur
  EXPECT_EQ(Found(":9", names), "0:2");
  EXPECT_EQ(Found("12:", names), "3:5");
  EXPECT_EQ(Found("7:14", names), "0:5");
  EXPECT_EQ(Found(":", names), "0:5");
}

TEST(FrameRange, CountsPositionsWhereNamesAreNoNumbers) {
  const FrameNames names = {"walk_a", "walk_b", "walk_c"};
  EXPECT_EQ(Found("walk_b", names), "1:2");
  EXPECT_EQ(Found("walk_b:", names), "1:3");
  EXPECT_EQ(Found("0:2", names), "0:2");
  EXPECT_EQ(Found("2", names), "2:3");
  EXPECT_EQ(Found("0:3", names), "0:3");
  EXPECT_THAT(Found("0:4", names), HasSubstr("frame 4 is not in DUMP; it has 3 frames, walk_a to walk_c"));
}

TEST(FrameRange, ErrorsListWhatIsThere) {
  const FrameNames names = {"0000", "0001", "0011"};
  EXPECT_THAT(Found("0099", names), HasSubstr("frame 0099 is not in DUMP; it has 3 frames, 0000 to 0011"));
  EXPECT_THAT(Found("5", names), HasSubstr("frame 5 is not in DUMP"));
  EXPECT_THAT(Found("0:99", names), HasSubstr("frame 99 is not in DUMP"));
  EXPECT_THAT(Found("99:", names), HasSubstr("frame 99 is not in DUMP"));
  EXPECT_THAT(Found("2:3", names), HasSubstr("no frame is in that range"));
  EXPECT_THAT(Found("1:0", names), HasSubstr("B of A:B is not included"));
  EXPECT_THAT(Found("two", names), HasSubstr("A:B"));
  EXPECT_THAT(Found("-1:2", names), HasSubstr("frame -1 is not in DUMP"));
  EXPECT_THAT(Found("3", {"0000"}), HasSubstr("it has one frame, 0000"));
  EXPECT_THAT(Found("", {}), HasSubstr("DUMP: holds no frame"));
}

}  // namespace
}  // namespace weft
