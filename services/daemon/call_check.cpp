#include "services/daemon/call_check.h"

#include <grpc/grpc_security_constants.h>
#include <grpcpp/security/auth_context.h>
#include <spdlog/spdlog.h>

#include "absl/strings/match.h"
#include "capture/file/plain_text.h"
#include "services/access/method_roles.h"
#include "services/rpc/grpc_status.h"

namespace weft {
namespace {

std::string ValueOf(const grpc::AuthMetadataProcessor::InputMetadata& metadata, const char* name) {
  const auto found = metadata.find(name);
  return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
}

std::string TokenOf(const grpc::AuthMetadataProcessor::InputMetadata& metadata) {
  constexpr absl::string_view kScheme = "bearer ";
  const std::string value = ValueOf(metadata, "authorization");
  return absl::StartsWithIgnoreCase(value, kScheme) ? value.substr(kScheme.size()) : value;
}

std::string PropertyOf(const grpc::AuthContext& context, const char* name) {
  const std::vector<grpc::string_ref> values = context.FindPropertyValues(name);
  return values.empty() ? "" : std::string(values[0].data(), values[0].size());
}

}  // namespace

void CallCheck::SetPeer(const Peer& peer) {
  const std::lock_guard lock(mutex_);
  peer_ = peer;
  trusted_user_ = trusts_users_ ? TrustedUserOf(peer) : "";
}

absl::Status CallCheck::CheckCertificate(const grpc::AuthContext& context) const {
  const std::string certificate = PropertyOf(context, GRPC_X509_PEM_CERT_PROPERTY_NAME);
  if (certificate.empty() || sources_.revocations == nullptr || !sources_.revocations->IsRevoked(certificate))
    return absl::OkStatus();
  return absl::UnauthenticatedError(
      "this certificate was revoked; ask the daemon's administrator for another one");
}

grpc::Status CallCheck::Process(const InputMetadata& metadata, grpc::AuthContext* context,
                                OutputMetadata* /*consumed*/, OutputMetadata* /*response*/) {
  const std::string method = ValueOf(metadata, ":path");
  if (RoleOfMethod(method) == v1::ROLE_UNSPECIFIED) return grpc::Status::OK;
  Credentials credentials;
  std::string peer;
  {
    const std::lock_guard lock(mutex_);
    credentials.local_user = trusted_user_;
    peer = peer_.name;
  }
  credentials.token = TokenOf(metadata);
  credentials.certificate_owner = PropertyOf(*context, GRPC_X509_CN_PROPERTY_NAME);
  absl::Status status = CheckCertificate(*context);
  if (status.ok()) {
    const absl::StatusOr<Caller> caller = sources_.access.Identify(credentials);
    status = caller.ok() ? CheckMayCall(*caller, method) : caller.status();
  }
  if (!status.ok()) {
    spdlog::warn("refused: {} of {}: {}", EscapedText(method), peer,
                 EscapedText(std::string(status.message())));
  }
  return ToGrpcStatus(status);
}

}  // namespace weft
