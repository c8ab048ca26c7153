#include "services/server/rpc/grpc_status.h"

#include <optional>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/server/rpc/error_detail.h"
#include "weft/v1/error.pb.h"

namespace weft {
namespace {

// google.rpc.Status, which gRPC sends in the trailing metadata. Empty for an error without a detail.
std::string DetailsOf(const absl::Status& status, const std::string& message) {
  const std::optional<v1::ErrorDetail> detail = DetailOf(status);
  if (!detail) return "";
  v1::RpcStatus rpc;
  rpc.set_code(status.raw_code());
  rpc.set_message(message);
  rpc.add_details()->PackFrom(*detail);
  // In base64.
  return rpc.ByteSizeLong() * 4 / 3 <= kMaxStatusBytes ? rpc.SerializeAsString() : "";
}

// Cut to what fits into a header, where bytes beside printable ASCII take three.
std::string Fitting(const std::string& text) {
  size_t taken = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    taken += text[i] > ' ' && text[i] < 0x7f && text[i] != '%' ? 1 : 3;
    if (text[i] == ' ') taken -= 2;
    if (taken <= kMaxStatusBytes) continue;
    while (i > 0 && (static_cast<unsigned char>(text[i]) & 0xc0) == 0x80) --i;  // not within a letter
    return absl::StrCat(text.substr(0, i), " ...");
  }
  return text;
}

}  // namespace

grpc::Status ToGrpcStatus(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  // It may quote any bytes of the request.
  const std::string message =
      Fitting(EscapedText(std::string(status.message().substr(0, 2 * kMaxStatusBytes))));
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
