// Every call's caller, role and limits, before its method begins.
#pragma once

#include <grpcpp/security/auth_metadata_processor.h>

#include <atomic>
#include <cstdint>

#include "base/mutex.h"
#include "services/server/access/access_control.h"
#include "services/server/access/audit_log.h"
#include "services/server/access/call_limits.h"
#include "services/server/access/certificates.h"
#include "services/server/daemon/door/observed_call.h"
#include "services/server/daemon/door/peer.h"
#include "services/server/daemon/door/receive_guard.h"

namespace weft {

// What decides about callers, and what is told of them.
struct CallerSources {
  AccessControl& access;
  CallLimits& limits;
  AuditLog& audit;
  ReceiveGuard& guard;
  RevocationList* revocations = nullptr;  // of clients' certificates; null: none is revoked
  CallEnded ended = {};                   // told of every call; may be empty
};

// Whom the connections of a listener vouch for.
enum class Trust {
  kNobody,   // calls show a token or a certificate
  kUsers,    // connections within this machine: their user counts
  kConsole,  // our own, for browsers: calls name the hash of a token that was shown to the console
};

// Of the connections of one peer at a time. Unimplemented: messages are compressed. Unauthenticated and
// PermissionDenied as AccessControl says, ResourceExhausted as CallLimits says; health is for everybody.
// Refusals are recorded. Thread safety: any thread.
class CallCheck final : public grpc::AuthMetadataProcessor {
 public:
  CallCheck(const CallerSources& sources, Trust trust) : sources_(sources), trust_(trust) {}

  void SetPeer(const Peer& peer);
  // Connections that asked for something, since the check was made.
  int connections();
  // Calls that were refused, since the check was made.
  int64_t refused() const { return refused_; }

  bool IsBlocking() const override { return false; }
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* context, OutputMetadata* consumed,
                       OutputMetadata* response) override;

 private:
  // The peer's name.
  std::string TakeNote(grpc::AuthContext* context);
  absl::Status CheckCertificate(const grpc::AuthContext& context) const;

  const CallerSources sources_;
  const Trust trust_;
  std::atomic<int64_t> refused_ = 0;
  Mutex mutex_;
  Peer peer_ ABSL_GUARDED_BY(mutex_);
  std::string trusted_user_ ABSL_GUARDED_BY(mutex_);
  int connections_ ABSL_GUARDED_BY(mutex_) = 0;
};

// What limits count callers by: their names, or their peer while nobody is recognized.
std::string AccountOf(const std::string& caller, const std::string& peer);

}  // namespace weft
