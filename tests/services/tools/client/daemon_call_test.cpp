// How clients meet a daemon that is busy.
#include "services/tools/client/daemon_call.h"

#include <gtest/gtest.h>

#include "services/server/rpc/grpc_status.h"
#include "services/server/rpc/retry_after.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

grpc::Status Busy(milliseconds delay, absl::StatusCode code = absl::StatusCode::kResourceExhausted) {
  return ToGrpcStatus(RetryLater(code, "24 calls run", delay));
}

TEST(CallWhenAdmitted, ComesAgainNotBeforeItMay) {
  int calls = 0;
  const Clock::time_point begin = Clock::now();
  const grpc::Status status =
      CallWhenAdmitted([&] { return ++calls < 4 ? Busy(milliseconds(20)) : grpc::Status::OK; });
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(calls, 4);
  EXPECT_GE(Clock::now() - begin, milliseconds(60));
}

TEST(CallWhenAdmitted, GivesUpAfterItsPatience) {
  int calls = 0;
  const grpc::Status status = CallWhenAdmitted(
      [&] {
        ++calls;
        return Busy(milliseconds(30));
      },
      milliseconds(100));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_GE(calls, 1);
  EXPECT_LE(calls, 4);
}

TEST(CallWhenAdmitted, RepeatsNothingElse) {
  for (const grpc::Status& refused :
       {grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "the disk is full"),
        grpc::Status(grpc::StatusCode::UNAVAILABLE, "no connection"),
        Busy(milliseconds(1), absl::StatusCode::kInternal), grpc::Status::CANCELLED, grpc::Status::OK}) {
    int calls = 0;
    CallWhenAdmitted([&] {
      ++calls;
      return refused;
    });
    EXPECT_EQ(calls, 1) << refused.error_message();
  }
}

TEST(PauseAfter, KeepsClientsApart) {
  milliseconds least = milliseconds::max(), most{0};
  for (int i = 0; i < 100; ++i) {
    const milliseconds pause = PauseAfter(Busy(milliseconds(1000))).value();
    least = std::min(least, pause);
    most = std::max(most, pause);
  }
  EXPECT_GE(least, milliseconds(1000));
  EXPECT_GE(most - least, milliseconds(500));
}

}  // namespace
}  // namespace weft
