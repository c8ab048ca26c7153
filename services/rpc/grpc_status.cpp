#include "services/rpc/grpc_status.h"

#include <optional>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/rpc/error_detail.h"
#include "weft/v1/error.pb.h"

namespace weft {
namespace {

// google.rpc.Status, which gRPC sends in the trailing metadata. Empty for an error without a detail.
std::string DetailsOf(const absl::Status& status, const std::string& message) {
  const std::optional<v1::ErrorDetail> detail = DetailOf(status);
  if (!detail || detail->ByteSizeLong() > kMaxStatusBytes) return "";
  v1::RpcStatus rpc;
  rpc.set_code(status.raw_code());
  rpc.set_message(message);
  rpc.add_details()->PackFrom(*detail);
  return rpc.SerializeAsString();
}

}  // namespace

grpc::Status ToGrpcStatus(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  std::string message(status.message().substr(0, kMaxStatusBytes));
  if (message.size() < status.message().size()) absl::StrAppend(&message, " ...");
  message = EscapedText(message);  // it may quote any bytes of the request
  // absl took its codes from gRPC.
  return {static_cast<grpc::StatusCode>(status.raw_code()), message, DetailsOf(status, message)};
}

absl::Status FromGrpcStatus(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  absl::Status result(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  v1::RpcStatus rpc;
  if (!rpc.ParseFromString(status.error_details())) return result;
  for (const google::protobuf::Any& detail : rpc.details()) {
    result.SetPayload(detail.type_url(), absl::Cord(detail.value()));
  }
  return result;
}

}  // namespace weft
