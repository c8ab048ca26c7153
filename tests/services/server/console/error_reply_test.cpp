#include "services/server/console/error_reply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/server/rpc/error_detail.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// RFC 9110, section 15: what a browser makes of each category.
TEST(ErrorReply, HasTheStatusOfHttp) {
  using Code = absl::StatusCode;
  const std::vector<std::pair<Code, int>> expected = {
      {Code::kInvalidArgument, 400},   {Code::kOutOfRange, 400},      {Code::kUnauthenticated, 401},
      {Code::kPermissionDenied, 403},  {Code::kNotFound, 404},        {Code::kFailedPrecondition, 409},
      {Code::kResourceExhausted, 429}, {Code::kInternal, 500},        {Code::kDataLoss, 500},
      {Code::kUnavailable, 503},       {Code::kDeadlineExceeded, 504}};
  for (const auto& [code, http] : expected)
    EXPECT_EQ(ErrorReply(absl::Status(code, "why")).status, http) << absl::StatusCodeToString(code);
}

TEST(ErrorReply, NamesFieldAndRemedyForThePage) {
  const HttpReply reply =
      ErrorReply(FieldError(absl::StatusCode::kInvalidArgument, {"spec.rig", "is \"missing\"", "name one"}));
  EXPECT_EQ(reply.type, "application/json");
  EXPECT_THAT(reply.body, HasSubstr("\"spec.rig\""));
  EXPECT_THAT(reply.body, HasSubstr("\"name one\""));
  EXPECT_THAT(reply.body, HasSubstr("spec.rig: is \\\"missing\\\"; name one"));
  EXPECT_THAT(reply.body, HasSubstr("INVALID_ARGUMENT"));
}

TEST(ErrorReply, IsJsonOfTheWholeError) {
  EXPECT_EQ(ErrorReply(absl::NotFoundError("no such job")).body,
            R"({"code":"NOT_FOUND","message":"no such job"})");
  EXPECT_EQ(
      ErrorReply(FieldError(absl::StatusCode::kAborted, {"version", "is another", "begin anew"})).body,
      R"({"code":"ABORTED","message":"version: is another; begin anew","field":"version","remedy":"begin anew"})");
  EXPECT_EQ(ErrorReply(absl::AlreadyExistsError("")).status, 409);
  EXPECT_EQ(ErrorReply(absl::AbortedError("")).status, 409);
  EXPECT_EQ(ErrorReply(absl::UnimplementedError("")).status, 404);
  EXPECT_EQ(ErrorReply(absl::UnknownError("a\xff")).body, R"({"code":"UNKNOWN","message":"a\\xff"})");
}

}  // namespace
}  // namespace weft
