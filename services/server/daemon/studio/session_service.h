// The service Sessions.
#pragma once

#include "services/server/daemon/calls/path_policy.h"
#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/studio/session_registry.h"
#include "services/server/daemon/studio/take_store.h"
#include "services/server/library/library.h"
#include "weft/v1/sessions.grpc.pb.h"

namespace weft {

// Thread safety: gRPC calls from many threads. Registries and library must outlive the service.
class SessionService final : public v1::Sessions::Service {
 public:
  SessionService(SessionRegistry& sessions, TakeStore& takes, const Library& library, PathPolicy policy,
                 FindCaller caller)
      : sessions_(sessions),
        takes_(takes),
        library_(library),
        policy_(std::move(policy)),
        caller_(std::move(caller)) {}

  grpc::Status OpenSession(grpc::ServerContext* context, const v1::OpenSessionRequest* request,
                           v1::CaptureSession* session) override;
  grpc::Status RenewSession(grpc::ServerContext* context, const v1::RenewSessionRequest* request,
                            v1::CaptureSession* session) override;
  grpc::Status CloseSession(grpc::ServerContext* context, const v1::CloseSessionRequest* request,
                            v1::CaptureSession* session) override;
  grpc::Status GetSession(grpc::ServerContext* context, const v1::GetSessionRequest* request,
                          v1::CaptureSession* session) override;
  grpc::Status ListSessions(grpc::ServerContext* context, const v1::ListSessionsRequest* request,
                            v1::ListSessionsResponse* response) override;

 private:
  absl::StatusOr<v1::CaptureSession> Open(const v1::OpenSessionRequest& asked, const Caller& caller);

  SessionRegistry& sessions_;
  TakeStore& takes_;
  const Library& library_;
  const PathPolicy policy_;
  const FindCaller caller_;
};

}  // namespace weft
