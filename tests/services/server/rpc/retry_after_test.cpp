#include "services/server/rpc/retry_after.h"

#include <gtest/gtest.h>

#include "services/server/rpc/grpc_status.h"

namespace weft {
namespace {

using std::chrono::milliseconds;

TEST(RetryAfter, IsReadAsItWasWritten) {
  for (const milliseconds delay :
       {milliseconds(0), milliseconds(1), milliseconds(250), milliseconds(60'000)}) {
    const absl::Status refused =
        RetryLater(absl::StatusCode::kResourceExhausted, "24 calls run; retry after 7 ms", delay);
    EXPECT_EQ(RetryAfter(std::string(refused.message())), delay);
    EXPECT_EQ(RetryAfter(ToGrpcStatus(refused).error_message()), delay);
  }
}

TEST(RetryAfter, IsAMinuteAtTheMost) {
  EXPECT_EQ(RetryAfter("full; retry after 999999999999 ms"), std::chrono::minutes(1));
}

TEST(RetryAfter, IsReadFromNothingElse) {
  for (const char* text :
       {"", "full", "; retry after  ms", "; retry after -1 ms", "; retry after 1 s",
        "; retry after 99999999999999999999 ms", "retry after 1 ms", "; retry after 1 ms."})
    EXPECT_EQ(RetryAfter(text), std::nullopt) << text;
}

}  // namespace
}  // namespace weft
