#include "services/ground/process/exit_status.h"

#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

TEST(ExitStatus, TellsBadInputFromFailure) {
  EXPECT_EQ(ExitStatusOf(absl::OkStatus()), 0);
  using Code = absl::StatusCode;
  for (const Code code : {Code::kInvalidArgument, Code::kNotFound, Code::kOutOfRange, Code::kAlreadyExists,
                          Code::kPermissionDenied, Code::kUnauthenticated, Code::kFailedPrecondition})
    EXPECT_EQ(ExitStatusOf(absl::Status(code, "")), 2) << absl::StatusCodeToString(code);
  for (const Code code :
       {Code::kCancelled, Code::kUnknown, Code::kDeadlineExceeded, Code::kResourceExhausted, Code::kAborted,
        Code::kUnimplemented, Code::kInternal, Code::kUnavailable, Code::kDataLoss})
    EXPECT_EQ(ExitStatusOf(absl::Status(code, "")), 1) << absl::StatusCodeToString(code);
}

// As wait(2) gives them on Linux.
TEST(ExitStatus, OfAnotherProcessIsDescribed) {
  EXPECT_EQ(DescribeExit(3 << 8), "exit status 3");
  EXPECT_EQ(DescribeExit(0), "exit status 0");
  EXPECT_EQ(DescribeExit(9), "killed by signal 9 (Killed)");
  EXPECT_EQ(DescribeExit(11 | 0x80), "killed by signal 11 (Segmentation fault)");  // with a core
}

TEST(ExitStatus, ErrorsAreOneLineOfPlainText) {
  const auto printed = [](auto print) {
    ::testing::internal::CaptureStderr();
    print();
    return ::testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(printed([] { PrintError(absl::NotFoundError("rig.json: no such file")); }),
            "weft: error: rig.json: no such file\n");
  EXPECT_EQ(printed([] { PrintError(absl::NotFoundError("a\x1b[2J")); }), "weft: error: a\\x1b[2J\n");
  EXPECT_EQ(printed([] { PrintError(absl::NotFoundError("")); }), "weft: error: NOT_FOUND\n");
  EXPECT_EQ(printed([] { PrintWarning("it is \x1b late"); }), "weft: warning: it is \\x1b late\n");
}

}  // namespace
}  // namespace weft
