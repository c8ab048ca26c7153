#include "services/server/daemon/studio/session_service.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/work/items/item_words.h"

namespace weft {

absl::StatusOr<v1::CaptureSession> SessionService::Open(const v1::OpenSessionRequest& asked,
                                                        const Caller& caller) {
  v1::OpenSessionRequest request = asked;
  const struct {
    const char* field;
    v1::ItemKind kind;
    std::string* input;
  } inputs[] = {{"rig", v1::ITEM_KIND_RIG, request.mutable_rig()},
                {"board", v1::ITEM_KIND_BOARD, request.mutable_board()},
                {"garment", v1::ITEM_KIND_TEMPLATE, request.mutable_garment()}};
  for (const auto& [field, kind, input] : inputs) {
    absl::string_view reference = *input;
    if (input->empty()) continue;
    if (!absl::ConsumePrefix(&reference, kLibraryPrefix)) {
      WEFT_RETURN_IF_ERROR(policy_.CheckInput(field, *input).status());
      continue;
    }
    WEFT_ASSIGN_OR_RETURN(const v1::LibraryItem item,
                          Naming(field, library_.Find(kind, std::string(reference))));
    // Versions that are uploaded meanwhile are for other sessions.
    *input = absl::StrCat(kLibraryPrefix, "sha256:", item.id());
  }
  // Whoever takes over lets takes that run go on.
  if (!request.take_over()) {
    WEFT_RETURN_IF_ERROR(takes_.CheckCamerasAreFree("cameras.cameras", request.cameras()));
  }
  return sessions_.Open(request, caller);
}

grpc::Status SessionService::OpenSession(grpc::ServerContext* context, const v1::OpenSessionRequest* request,
                                         v1::CaptureSession* session) {
  return Answer("OpenSession", [&] { return Assign(Open(*request, caller_(*context)), session); });
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
    WEFT_ASSIGN_OR_RETURN(const int limit, LimitOf(request->limit()));
    return Assign(sessions_.List(static_cast<size_t>(limit), request->page_token()), response);
  });
}

}  // namespace weft
