// Every call's caller and role, before its method begins.
#pragma once

#include <grpcpp/security/auth_metadata_processor.h>

#include <mutex>

#include "services/access/access_control.h"
#include "services/access/certificates.h"
#include "services/daemon/peer.h"

namespace weft {

// Who may vouch for a caller.
struct CallerSources {
  AccessControl& access;
  RevocationList* revocations = nullptr;  // of clients' certificates; null: none is revoked
};

// Of the connections of one peer at a time. Unauthenticated and PermissionDenied as AccessControl says;
// health is for everybody. Thread safety: any thread.
class CallCheck final : public grpc::AuthMetadataProcessor {
 public:
  // `trusts_users`: whether the user of the connection counts, which is for connections within this machine.
  CallCheck(const CallerSources& sources, bool trusts_users)
      : sources_(sources), trusts_users_(trusts_users) {}

  void SetPeer(const Peer& peer);

  bool IsBlocking() const override { return false; }
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* context, OutputMetadata* consumed,
                       OutputMetadata* response) override;

 private:
  absl::Status CheckCertificate(const grpc::AuthContext& context) const;

  const CallerSources sources_;
  const bool trusts_users_;
  std::mutex mutex_;
  Peer peer_;
  std::string trusted_user_;
};

}  // namespace weft
