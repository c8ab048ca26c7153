#include "services/ground/process/exit_status.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

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
