#include "services/tools/client/session_client.h"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>

#include "base/mutex.h"
#include "services/tools/client/daemon_call.h"

namespace weft {

absl::StatusOr<v1::CaptureSession> SessionClient::Open(const v1::OpenSessionRequest& request) {
  return CallDaemon(connection_, *stub_, &v1::Sessions::Stub::OpenSession, request);
}

absl::StatusOr<v1::CaptureSession> SessionClient::Renew(const std::string& lease) {
  return CallDaemon(connection_, *stub_, &v1::Sessions::Stub::RenewSession,
                    RequestNaming<v1::RenewSessionRequest>(lease));
}

absl::StatusOr<v1::CaptureSession> SessionClient::Close(const std::string& lease) {
  return CallDaemon(connection_, *stub_, &v1::Sessions::Stub::CloseSession,
                    RequestNaming<v1::CloseSessionRequest>(lease));
}

absl::StatusOr<v1::ListSessionsResponse> SessionClient::List(int limit) {
  return CallForPages(connection_, *stub_, &v1::Sessions::Stub::ListSessions, v1::ListSessionsRequest(),
                      limit, &v1::ListSessionsResponse::sessions_size);
}

absl::Status SessionClient::Hold(const v1::CaptureSession& session, const std::string& lease,
                                 const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  const std::chrono::duration<double> lease_time(session.lease_s());
  Mutex mutex;
  std::condition_variable_any asked;
  MutexLock lock(mutex);
  for (Clock::time_point renewed = Clock::now();;) {
    asked.wait_for(lock, stop, lease_time / 3, [] { return false; });
    if (stop.stop_requested()) return absl::OkStatus();
    const absl::Status status = Renew(lease).status();
    if (status.ok()) {
      renewed = Clock::now();
    } else if (!absl::IsUnavailable(status) || Clock::now() - renewed > lease_time) {
      return status;
    }
  }
}

}  // namespace weft
