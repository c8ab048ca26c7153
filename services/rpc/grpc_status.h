// The one place where our statuses become gRPC's and back; categories and details (error_detail.h) are the
// same on both sides.
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace weft {

// Messages longer than kMaxStatusBytes are cut, and details longer than that are left out: they travel in
// headers.
inline constexpr size_t kMaxStatusBytes = 4000;
grpc::Status ToGrpcStatus(const absl::Status& status);

absl::Status FromGrpcStatus(const grpc::Status& status);

}  // namespace weft
