// How `weft` prints progress.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "services/tools/cli/progress.h"

namespace weft {
namespace {

TEST(ProgressLine, ShowsShareCountAndRemainingTime) {
  // The bar takes what the width leaves: here 33, 15 and 16 characters.
  const std::string quarter = std::string(8, '#') + std::string(25, '.');
  EXPECT_EQ(ProgressLine("decode", 6, 24, 10, 60), "decode  [" + quarter + "]  6/24  0:30 left");
  EXPECT_EQ(ProgressLine("decode", 0, 4, 3, 30), "decode  [" + std::string(15, '.') + "]  0/4");
  EXPECT_EQ(ProgressLine("decode", 4, 4, 3661, 40), "decode  [" + std::string(16, '#') + "]  4/4  1:01:01");
}

TEST(ProgressLine, FitsNarrowTerminals) {
  for (int width = 0; width < 100; ++width) {
    EXPECT_LE(ProgressLine("decode", 3, 1000, 1e6, width).size(), static_cast<size_t>(width));
  }
}

}  // namespace
}  // namespace weft
