#include "services/tools/cli/print_verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/verdict/verdict.h"

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

}  // namespace
}  // namespace weft
