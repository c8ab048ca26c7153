// How `weft` prints progress.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tbb/info.h>
#include <unistd.h>
#include <string>

#include "services/tools/cli/progress.h"
#include "tests/services/tools/cli/test_terminal.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

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

TEST(ProgressLine, ShowsPercentAndRoundsTimes) {
  EXPECT_EQ(ProgressLine("fetch", 1, 4, 19.9, 50, ProgressUnit::kPercent),
            "fetch  [" + std::string(5, '#') + std::string(18, '.') + "]   25 %  1:00 left");
  EXPECT_EQ(ProgressLine("fetch", 0, 0, 0, 27, ProgressUnit::kPercent), "fetch  [#####]  100 %  0:00");
  EXPECT_EQ(ProgressLine("fetch", 9, 4, 3599.4, 12), "fetch  4/4  ") << "no more than all";
  EXPECT_EQ(ProgressLine("a", 1, 2, 3599.5, 14), "a  1/2  1:00:0");
  EXPECT_EQ(ProgressLine("a", 2, 2, 3725, 80), "a  [" + std::string(40, '#') + "]  2/2  1:02:05");
}

TEST(ProgressLine, HasABarWhereThereIsRoomForOne) {
  EXPECT_EQ(ProgressLine("decode", 0, 4, 3, 20), "decode  [.....]  0/4");
  EXPECT_EQ(ProgressLine("decode", 0, 4, 3, 19), "decode  0/4");
  EXPECT_EQ(ProgressLine("decode", 0, 4, 3, 100), "decode  [" + std::string(40, '.') + "]  0/4");
}

// Tests have no terminal.
TEST(Progress, IsSeenWhereSomebodyLooks) {
  EXPECT_FALSE(ProgressVisible(false));
  const TestTerminal terminal({STDERR_FILENO});
  EXPECT_TRUE(ProgressVisible(false));
  EXPECT_FALSE(ProgressVisible(true));
}

TEST(Progress, DrawsItselfAnewBelowALineAndGoes) {
  const std::string begin = "\r\033[Kdecode  [" + std::string(40, '.') + "]  0/24";
  ::testing::internal::CaptureStderr();
  {
    Progress progress("decode", 24, true);
    progress.PrintLine("frame 3 is left out");
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            begin + "\r\033[Kframe 3 is left out\n" + begin + "\r\033[K");
  ::testing::internal::CaptureStderr();
  {
    Progress progress("decode", 24, false);
    progress.Advance(3);
    progress.PrintLine("frame 3 is left out");
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "frame 3 is left out\n");
}

TEST(Progress, CountsStepsAndTakesOthers) {
  ::testing::internal::CaptureStderr();
  {
    Progress progress("decode", 4, true, ProgressUnit::kPercent);
    progress.Advance();
    progress.Advance(3);
    progress.PrintLine("a");
    progress.Set(0, 9);
    progress.PrintLine("b");
  }
  const std::string shown = ::testing::internal::GetCapturedStderr();
  const auto last_before = [&](const std::string& line) {
    const std::string before = shown.substr(0, shown.find(line));
    return before.substr(before.rfind("decode"));
  };
  EXPECT_THAT(shown.substr(shown.find("a\n")), HasSubstr("]  100 %  0:00\r"));
  EXPECT_THAT(shown.substr(shown.find("b\n")), HasSubstr("]    0 %\r"));
  EXPECT_THAT(last_before("a\n"), HasSubstr("]    0 %")) << "not drawn again at once";
}

// In a process of its own: whoever watches stays.
TEST(Progress, IsLinesForAProgramThatWatches) {
  const auto watched = [] {
    PrintProgressAsLines();
    if (!ProgressVisible(false) || ProgressVisible(true)) _exit(1);
    {
      Progress progress("decode", 24, true);
      progress.Set(12, 25);
      progress.PrintLine("a note");
    }
    StageBars bars(false);
    bars.PrintLine("before the first");
    bars.Set("read", 1, 2);
    bars.Set("read", 2, 3);
    bars.PrintLine("of the first");
    bars.SetShare("solve", 0.25);
    bars.PrintLine("of the second");
    StageBars quiet(true);
    quiet.Set("never", 1, 2);
    _exit(0);
  };
  const std::string now =
      "(weft: progress: [a-z]+: [0-9]+ of [0-9]+\n)*";  // where a tenth of a second passed
  EXPECT_EXIT(watched(), ::testing::ExitedWithCode(0),
              "^weft: progress: decode: 0 of 24\n" + now +
                  "a note\nweft: progress: decode: 12 of 25\nweft: progress: read: 0 of "
                  "2\n" +
                  now + "of the first\nweft: progress: read: 2 of 3\nweft: progress: solve: 0 of 1000\n" +
                  now + "of the second\nweft: progress: solve: 250 of 1000\n$");
}

TEST(Progress, WorkRunsWithItsThreadsAndAnswers) {
  const auto threads = [](const auto&) { return tbb::this_task_arena::max_concurrency(); };
  EXPECT_EQ(WithBar("a", true, 3, threads), 3);
  EXPECT_EQ(WithStageBars(true, 2, threads), 2);
  EXPECT_EQ(WithShareBar("a", true, 2, threads), 2);
  EXPECT_EQ(WithBar("a", true, 0, threads), tbb::info::default_concurrency());
  EXPECT_EQ(WithStageBars(true, 0, threads), tbb::info::default_concurrency());
}

}  // namespace
}  // namespace weft
