// What `weft` prints: progress, wrapped help, exit statuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "services/cli/command_line.h"
#include "services/cli/help.h"
#include "services/cli/progress.h"

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

TEST(WrapText, BreaksAtSpacesAndIndentsWhatFollows) {
  EXPECT_EQ(WrapText("one two three", 8, 2), "one two\n  three");
  EXPECT_EQ(WrapText("a\nb", 80, 4), "a\n    b");
  EXPECT_EQ(WrapText("unbreakable", 3, 0), "unbreakable");
}

TEST(ExitStatus, TellsBadInputFromFailure) {
  EXPECT_EQ(ExitStatusOf(absl::OkStatus()), 0);
  EXPECT_EQ(ExitStatusOf(absl::InvalidArgumentError("")), 2);
  EXPECT_EQ(ExitStatusOf(absl::NotFoundError("")), 2);
  EXPECT_EQ(ExitStatusOf(absl::PermissionDeniedError("")), 2);
  EXPECT_EQ(ExitStatusOf(absl::ResourceExhaustedError("")), 1);
  EXPECT_EQ(ExitStatusOf(absl::InternalError("")), 1);
}

}  // namespace
}  // namespace weft
