#include "services/rpc/grpc_status.h"

#include "absl/strings/str_cat.h"

namespace weft {

grpc::Status ToGrpcStatus(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  std::string message(status.message().substr(0, kMaxStatusBytes));
  if (message.size() < status.message().size()) absl::StrAppend(&message, " ...");
  // absl took its codes from gRPC.
  return {static_cast<grpc::StatusCode>(status.raw_code()), message};
}

absl::Status FromGrpcStatus(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  return {static_cast<absl::StatusCode>(status.error_code()), status.error_message()};
}

}  // namespace weft
