#include "services/daemon/session_service.h"

#include "absl/strings/match.h"
#include "services/daemon/answer.h"
#include "services/daemon/request_check.h"

namespace weft {

absl::StatusOr<v1::CaptureSession> SessionService::Open(const v1::OpenSessionRequest& request) {
  for (const auto& [field, path] : {std::pair<const char*, const std::string&>{"rig", request.rig()},
                                    {"board", request.board()},
                                    {"garment", request.garment()}}) {
    if (path.empty() || absl::StartsWith(path, "library:")) continue;
    if (const auto allowed = policy_.CheckInput(field, path); !allowed.ok()) return allowed.status();
  }
  // Whoever takes over lets takes that run go on.
  if (!request.take_over()) {
    if (absl::Status status = takes_.CheckCamerasAreFree("cameras.cameras", request.cameras());
        !status.ok()) {
      return status;
    }
  }
  return sessions_.Open(request);
}

grpc::Status SessionService::OpenSession(grpc::ServerContext*, const v1::OpenSessionRequest* request,
                                         v1::CaptureSession* session) {
  return Answer("OpenSession", [&] { return Assign(Open(*request), session); });
}

grpc::Status SessionService::RenewSession(grpc::ServerContext*, const v1::RenewSessionRequest* request,
                                          v1::CaptureSession* session) {
  return Answer("RenewSession", [&] { return Assign(sessions_.Renew(request->lease()), session); });
}

grpc::Status SessionService::CloseSession(grpc::ServerContext*, const v1::CloseSessionRequest* request,
                                          v1::CaptureSession* session) {
  return Answer("CloseSession", [&] { return Assign(sessions_.Close(request->lease()), session); });
}

grpc::Status SessionService::GetSession(grpc::ServerContext*, const v1::GetSessionRequest* request,
                                        v1::CaptureSession* session) {
  return Answer("GetSession", [&] { return Assign(sessions_.Get(request->session_id()), session); });
}

grpc::Status SessionService::ListSessions(grpc::ServerContext*, const v1::ListSessionsRequest* request,
                                          v1::ListSessionsResponse* response) {
  return Answer("ListSessions", [&]() -> absl::Status {
    const absl::StatusOr<int> limit = LimitOf(request->limit());
    if (!limit.ok()) return limit.status();
    *response = sessions_.List(static_cast<size_t>(*limit));
    return absl::OkStatus();
  });
}

}  // namespace weft
