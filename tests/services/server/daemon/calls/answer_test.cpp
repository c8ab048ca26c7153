#include "services/server/daemon/calls/answer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

#include "services/server/rpc/error_detail.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(DaemonAnswer, HandsOnWhatTheHandlerSays) {
  EXPECT_TRUE(Answer("Test", [] { return absl::OkStatus(); }).ok());
  const grpc::Status refused = Answer("Test", [] {
    return FieldError(absl::StatusCode::kNotFound, {"job_id", "no such job", "list them"});
  });
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(refused.error_message(), "job_id: no such job; list them");
}

TEST(DaemonAnswer, MakesExceptionsTheCallsOwnError) {
  const grpc::Status thrown = Answer("Test", []() -> absl::Status { throw std::runtime_error("bad page"); });
  EXPECT_EQ(thrown.error_code(), grpc::StatusCode::INTERNAL);
  EXPECT_THAT(std::string(thrown.error_message()), HasSubstr("bad page"));
  const grpc::Status full = Answer("Test", []() -> absl::Status { throw std::bad_alloc(); });
  EXPECT_EQ(full.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(std::string(full.error_message()), HasSubstr("out of memory"));
}

TEST(DaemonAnswer, AssignsOnlyWhatThereIs) {
  int value = 1;
  EXPECT_FALSE(Assign(absl::StatusOr<int>(absl::NotFoundError("none")), &value).ok());
  EXPECT_EQ(value, 1);
  EXPECT_TRUE(Assign(absl::StatusOr<int>(2), &value).ok());
  EXPECT_EQ(value, 2);
}

}  // namespace
}  // namespace weft
