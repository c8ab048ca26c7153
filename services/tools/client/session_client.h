// The client's side of the capture sessions of weftd.
#pragma once

#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "services/tools/client/daemon_call.h"
#include "weft/v1/sessions.grpc.pb.h"

namespace weft {

class SessionClient : public ServiceClient<v1::Sessions> {
 public:
  using Session = absl::StatusOr<v1::CaptureSession>;
  using ServiceClient::ServiceClient;

  // The request needs an idempotency key.
  Session Open(const v1::OpenSessionRequest& request) { return Call(&Stub::OpenSession, request); }
  Session Renew(const std::string& lease) { return CallNaming(&Stub::RenewSession, lease); }
  Session Close(const std::string& lease) { return CallNaming(&Stub::CloseSession, lease); }
  absl::StatusOr<v1::ListSessionsResponse> List(int limit) {
    return CallForPages(connection_, *stub_, &Stub::ListSessions, v1::ListSessionsRequest(), limit,
                        &v1::ListSessionsResponse::sessions_size);
  }
  // Renews the lease, three times in its length, until `stop`: Ok. A daemon that is away for less than the
  // lease costs nothing. Otherwise the error that ended the session.
  absl::Status Hold(const v1::CaptureSession& session, const std::string& lease, const std::stop_token& stop);
};

}  // namespace weft
