#include "services/server/daemon/door/call_check.h"

#include <grpc/grpc_security_constants.h>
#include <grpcpp/security/auth_context.h>
#include <spdlog/spdlog.h>

#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/server/daemon/door/call_identity.h"
#include "services/server/rpc/grpc_status.h"

namespace weft {
namespace {

absl::Status CheckSize(const CallMetadata& metadata) {
  constexpr size_t kMost_bytes = 16 << 10;
  size_t bytes = 0;
  for (const auto& [name, value] : metadata) bytes += name.size() + value.size();
  if (bytes <= kMost_bytes) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("the call's metadata has ", bytes, " bytes, at most ", kMost_bytes, " are allowed"));
}

absl::Status CheckEncoding(const CallMetadata& metadata) {
  const std::string encoding = ValueOf(metadata, "grpc-encoding");
  if (encoding.empty() || encoding == "identity") return absl::OkStatus();
  return absl::UnimplementedError(absl::StrCat("this call's messages are compressed (grpc-encoding ",
                                               encoding,
                                               "); weftd takes identity alone; call without compression"));
}

}  // namespace

std::string AccountOf(const std::string& caller, const std::string& peer) {
  return caller.empty() ? absl::StrCat("peer ", peer) : caller;
}

void CallCheck::SetPeer(const Peer& peer) {
  const MutexLock lock(mutex_);
  peer_ = peer;
  trusted_user_ = trust_ == Trust::kUsers ? TrustedUserOf(peer) : "";
}

int CallCheck::connections() {
  const MutexLock lock(mutex_);
  return connections_;
}

std::string CallCheck::TakeNote(grpc::AuthContext* context) {
  const MutexLock lock(mutex_);
  std::string peer = PeerNameOf(*context);
  if (!peer.empty()) return peer;
  NotePeer(peer_.name, trusted_user_, context);
  if (trust_ == Trust::kConsole) NoteConsole(context);
  ++connections_;
  return peer_.name;
}

absl::Status CallCheck::CheckCertificate(const grpc::AuthContext& context) const {
  const std::string certificate = PropertyOf(context, GRPC_X509_PEM_CERT_PROPERTY_NAME);
  if (certificate.empty() || sources_.revocations == nullptr || !sources_.revocations->IsRevoked(certificate))
    return absl::OkStatus();
  return absl::UnauthenticatedError(
      absl::StrCat("the certificate of \"", PropertyOf(context, GRPC_X509_CN_PROPERTY_NAME),
                   "\" was revoked; ask the daemon's administrator for another one"));
}

grpc::Status CallCheck::Process(const InputMetadata& metadata, grpc::AuthContext* context,
                                OutputMetadata* /*consumed*/, OutputMetadata* /*response*/) {
  const std::string path = ValueOf(metadata, ":path");
  const Method method = MethodOf(path);
  v1::AuditEntry entry;
  entry.set_peer(EscapedText(TakeNote(context)));
  absl::Status status = CheckSize(metadata);
  status.Update(CheckEncoding(metadata));
  v1::Role role = v1::ROLE_UNSPECIFIED;
  if (status.ok() && method.role != v1::ROLE_UNSPECIFIED) {
    status = CheckCertificate(*context);
    if (status.ok()) {
      const absl::StatusOr<Caller> caller = sources_.access.Identify(CredentialsOf(metadata, *context));
      if (caller.ok()) {
        entry.set_caller(EscapedText(caller->name));
        role = caller->role;
      }
      status = caller.ok() ? CheckMayCall(*caller, path) : caller.status();
    }
  }
  const std::string account = AccountOf(entry.caller(), entry.peer());
  // gRPC shows no observer the calls of its own services (health), so nobody would tell that they began.
  const bool is_counted = status.ok() && method.is_ours;
  const absl::Status room =
      is_counted ? sources_.limits.Admit(account, method.kind, role) : sources_.limits.Charge(account);
  if (!room.ok()) status = room;
  if (status.ok()) return grpc::Status::OK;
  ++refused_;
  constexpr size_t kLongestName = 200;  // a path is the client's
  entry.set_method(EscapedText(method.name.substr(0, kLongestName)));
  entry.set_outcome(absl::StatusCodeToString(status.code()));
  entry.set_message(EscapedText(std::string(status.message())));
  if (sources_.ended) sources_.ended({method, entry.outcome(), {}});
  if (sources_.audit.Refused(entry)) {
    spdlog::warn("refused: {} of {}: {}", entry.method(), entry.peer(), entry.message());
  }
  return ToGrpcStatus(status);
}

}  // namespace weft
