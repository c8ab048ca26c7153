// The client's side of the capture sessions of weftd.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "services/tools/client/registration_client.h"
#include "weft/v1/sessions.grpc.pb.h"

namespace weft {

// Errors as those of RegistrationClient. Thread safety: any thread may call any function. `connection` must
// outlive it.
class SessionClient {
 public:
  explicit SessionClient(const RegistrationClient& connection)
      : connection_(connection), stub_(v1::Sessions::NewStub(connection.channel())) {}

  // The request needs an idempotency key.
  absl::StatusOr<v1::CaptureSession> Open(const v1::OpenSessionRequest& request);
  absl::StatusOr<v1::CaptureSession> Renew(const std::string& lease);
  absl::StatusOr<v1::CaptureSession> Close(const std::string& lease);
  absl::StatusOr<v1::ListSessionsResponse> List(int limit);
  // Renews the lease, three times in its length, until `stop`: Ok. A daemon that is away for less than the
  // lease costs nothing. Otherwise the error that ended the session.
  absl::Status Hold(const v1::CaptureSession& session, const std::string& lease, const std::stop_token& stop);

 private:
  const RegistrationClient& connection_;
  const std::unique_ptr<v1::Sessions::Stub> stub_;
};

}  // namespace weft
