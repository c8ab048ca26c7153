// --frames of `weft evaluate SOURCE --avatar AVATAR`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "services/tools/cli/evaluate_avatar.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

std::pair<size_t, size_t> RangeOf(const std::string& text) {
  const absl::StatusOr<FrameRange> range = ParseScoredFrames(text);
  EXPECT_TRUE(range.ok()) << range.status();
  return range.ok() ? std::pair(range->first, range->end) : std::pair<size_t, size_t>(0, 0);
}

TEST(ParseScoredFrames, ARangeIsThatOfOtherCommands) {
  EXPECT_EQ(RangeOf("3:10"), std::pair(size_t{3}, size_t{10}));
  EXPECT_EQ(RangeOf(":10"), std::pair(size_t{0}, size_t{10}));
  EXPECT_EQ(RangeOf("3:"), std::pair(size_t{3}, SIZE_MAX));
  EXPECT_EQ(RangeOf(""), std::pair(size_t{0}, SIZE_MAX));
}

TEST(ParseScoredFrames, ANumberIsACountAsBefore) {
  EXPECT_EQ(RangeOf("6"), std::pair(size_t{0}, size_t{6}));
  EXPECT_EQ(RangeOf("0"), std::pair(size_t{0}, SIZE_MAX));
}

TEST(ParseScoredFrames, RefusesWhatIsNoRange) {
  for (const char* text : {"-1", "a", "5:5", "9:3", "1:2:3", "1:b", "1.5", "0:0"}) {
    const absl::Status status = ParseScoredFrames(text).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << text;
    EXPECT_THAT(status.message(), HasSubstr("--frames")) << text;
  }
}

}  // namespace
}  // namespace weft
