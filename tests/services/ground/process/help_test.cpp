#include "services/ground/process/help.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(WrapText, BreaksAtSpacesAndIndentsWhatFollows) {
  EXPECT_EQ(WrapText("one two three", 8, 2), "one two\n  three");
  EXPECT_EQ(WrapText("a\nb", 80, 4), "a\n    b");
  EXPECT_EQ(WrapText("unbreakable", 3, 0), "unbreakable");
}

}  // namespace
}  // namespace weft
