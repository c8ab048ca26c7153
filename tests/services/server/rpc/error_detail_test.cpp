#include "services/server/rpc/error_detail.h"

#include <gtest/gtest.h>

#include "services/server/rpc/grpc_status.h"

namespace weft {
namespace {

TEST(ErrorDetail, StandsInTheMessageAndBesideIt) {
  const absl::Status status =
      FieldError(absl::StatusCode::kNotFound, {"spec.rig", "/a/rig.json: no such file", "copy it there"});
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(status.message(), "spec.rig: /a/rig.json: no such file; copy it there");
  const auto detail = DetailOf(status);
  ASSERT_TRUE(detail);
  EXPECT_EQ(detail->field(), "spec.rig");
  EXPECT_EQ(detail->remedy(), "copy it there");
}

TEST(ErrorDetail, WithoutARemedyEndsWithTheProblem) {
  const absl::Status status = FieldError(absl::StatusCode::kInvalidArgument, {"limit", "-1 is negative", ""});
  EXPECT_EQ(status.message(), "limit: -1 is negative");
}

TEST(ErrorDetail, OfOtherErrorsIsNone) {
  EXPECT_FALSE(DetailOf(absl::OkStatus()));
  EXPECT_FALSE(DetailOf(absl::NotFoundError("spec.rig: no such file; copy it there")));
}

// What clients sent is quoted, and protobuf's texts are UTF-8.
TEST(ErrorDetail, IsPlainTextWhateverTheFieldHolds) {
  const auto detail = DetailOf(FieldError(absl::StatusCode::kInvalidArgument, {"a\xff", "is wrong", "no\n"}));
  ASSERT_TRUE(detail);
  EXPECT_EQ(detail->field(), "a\\xff");
  EXPECT_EQ(detail->remedy(), "no\\x0a");
}

TEST(ErrorDetail, ArrivesAtClients) {
  const absl::Status sent =
      FieldError(absl::StatusCode::kAborted, {"version", "is another one", "begin anew"});
  const absl::Status got = FromGrpcStatus(ToGrpcStatus(sent));
  EXPECT_EQ(got.code(), absl::StatusCode::kAborted);
  const auto detail = DetailOf(got);
  ASSERT_TRUE(detail);
  EXPECT_EQ(detail->field(), "version");
  EXPECT_EQ(detail->remedy(), "begin anew");
}

}  // namespace
}  // namespace weft
