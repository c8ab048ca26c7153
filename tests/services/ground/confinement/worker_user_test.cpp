#include "services/ground/confinement/worker_user.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "services/ground/confinement/landlock.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(WorkerUser, NamesUsersThatCannotBe) {
  for (const char* name : {"no-such-user-here", "root", ""}) {
    const absl::Status status = CheckWorkerUser(name);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << name;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--worker-user"));
  }
}

TEST(WorkerUser, SaysWhichUsersCannotBe) {
  EXPECT_EQ(CheckWorkerUser("no-such-user").message(),
            "--worker-user: no user \"no-such-user\" on this machine; make it with `useradd --system`");
  EXPECT_EQ(CheckWorkerUser("root").message(), "--worker-user: is root; name a user of the workers' own");
}

TEST(WorkerUser, NeedsRoot) {
  const absl::Status status = CheckWorkerUser("nobody");
  if (geteuid() == 0 && LandlockVersion() > 0) {
    EXPECT_TRUE(status.ok()) << status;
  } else {
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  }
}

}  // namespace
}  // namespace weft
