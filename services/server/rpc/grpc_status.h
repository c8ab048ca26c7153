// The one place where our statuses become gRPC's and back; categories and details (error_detail.h) are the
// same on both sides.
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace weft {

// Status and details travel in headers, of which clients take 8 KiB in all. Messages that take more than
// kMaxStatusBytes there are cut, and details are left out that take more.
inline constexpr size_t kMaxStatusBytes = 3500;
grpc::Status ToGrpcStatus(const absl::Status& status);

absl::Status FromGrpcStatus(const grpc::Status& status);

}  // namespace weft
