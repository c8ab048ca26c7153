#include "services/tools/cli/print_verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdlib.h>
#include <unistd.h>

#include "services/formats/verdict/verdict.h"
#include "tests/services/tools/cli/test_terminal.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// The test's output is a file while it is captured, as that of a pipe.
TEST(PrintVerdict, HasNoColoursWhereNobodyLooks) {
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_USABLE, "3 frames are missing", "look at the link");
  ::testing::internal::CaptureStdout();
  PrintVerdict(verdict);
  const std::string printed = ::testing::internal::GetCapturedStdout();
  EXPECT_THAT(printed, StartsWith("usable: 3 frames are missing\n"));
  EXPECT_THAT(printed, HasSubstr("remedy: look at the link\n"));
  EXPECT_THAT(printed, Not(HasSubstr("\033")));
}

TEST(PrintVerdict, ColoursTheGradeWhereSomebodyLooks) {
  unsetenv("NO_COLOR");
  const auto shown = [](v1::Grade grade) {
    v1::Verdict verdict;
    AddFinding(verdict, grade, "as it is", "");
    const TestTerminal terminal({STDOUT_FILENO});
    PrintVerdict(verdict);
    return terminal.Shown();
  };
  EXPECT_EQ(shown(v1::GRADE_GOOD), "\033[1;32mgood\033[0m: as it is\r\n");
  EXPECT_EQ(shown(v1::GRADE_USABLE), "\033[1;33musable\033[0m: as it is\r\n");
  EXPECT_EQ(shown(v1::GRADE_BAD), "\033[1;31mbad\033[0m: as it is\r\n");
  setenv("NO_COLOR", "", 1);
  EXPECT_EQ(shown(v1::GRADE_BAD), "\033[1;31mbad\033[0m: as it is\r\n");
  setenv("NO_COLOR", "1", 1);
  EXPECT_EQ(shown(v1::GRADE_BAD), "bad: as it is\r\n");
  unsetenv("NO_COLOR");
}

}  // namespace
}  // namespace weft
