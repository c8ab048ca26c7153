#include "base/error_reason.h"

#include <gtest/gtest.h>

#include "base/named_status.h"

namespace weft {
namespace {

TEST(ErrorReason, IsNoneUnlessOneIsGiven) {
  EXPECT_EQ(ReasonOf(absl::OkStatus()), ErrorReason::kNone);
  EXPECT_EQ(ReasonOf(absl::ResourceExhaustedError("make room on the disk")), ErrorReason::kNone);
  EXPECT_EQ(ReasonOf(WithReason(absl::OkStatus(), ErrorReason::kDiskFull)), ErrorReason::kNone);
}

TEST(ErrorReason, StaysWithAnErrorWhoseMessageIsRewritten) {
  for (const ErrorReason reason : {ErrorReason::kDiskFull, ErrorReason::kNoFreeThread}) {
    const absl::Status status = WithReason(absl::ResourceExhaustedError("full"), reason);
    EXPECT_EQ(status.message(), "full");
    EXPECT_EQ(ReasonOf(status), reason);
    const absl::Status named = Naming("mesh.ply", status);
    EXPECT_EQ(named.message(), "mesh.ply: full");
    EXPECT_EQ(named.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(ReasonOf(named), reason);
    EXPECT_EQ(ReasonOf(WithMessage(named, "other words")), reason);
  }
}

}  // namespace
}  // namespace weft
