#include "services/server/daemon/studio/session_service.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/work/items/item_words.h"
#include "weft/v1/sessions.grpc.pb.h"

namespace weft {
namespace {

class SessionService final : public v1::Sessions::Service {
 public:
  SessionService(SessionRegistry& sessions, TakeStore& takes, const Library& library, PathPolicy policy,
                 FindCaller caller)
      : sessions_(sessions),
        takes_(takes),
        library_(library),
        policy_(std::move(policy)),
        caller_(std::move(caller)) {}

  grpc::Status OpenSession(CallContext* context, const v1::OpenSessionRequest* request,
                           v1::CaptureSession* session) override {
    return Answer("OpenSession", [&] { return Assign(Open(*request, caller_(*context)), session); });
  }

  grpc::Status RenewSession(CallContext*, const v1::RenewSessionRequest* request,
                            v1::CaptureSession* session) override {
    return Answer("RenewSession", [&] { return Assign(sessions_.Renew(request->lease()), session); });
  }

  grpc::Status CloseSession(CallContext*, const v1::CloseSessionRequest* request,
                            v1::CaptureSession* session) override {
    return Answer("CloseSession", [&] { return Assign(sessions_.Close(request->lease()), session); });
  }

  grpc::Status GetSession(CallContext*, const v1::GetSessionRequest* request,
                          v1::CaptureSession* session) override {
    return Answer("GetSession", [&] { return Assign(sessions_.Get(request->session_id()), session); });
  }

  grpc::Status ListSessions(CallContext*, const v1::ListSessionsRequest* request,
                            v1::ListSessionsResponse* response) override {
    return Answer("ListSessions", [&]() -> absl::Status {
      WEFT_ASSIGN_OR_RETURN(const int limit, LimitOf(request->limit()));
      return Assign(sessions_.List(static_cast<size_t>(limit), request->page_token()), response);
    });
  }

 private:
  absl::StatusOr<v1::CaptureSession> Open(const v1::OpenSessionRequest& asked, const Caller& caller) {
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

  SessionRegistry& sessions_;
  TakeStore& takes_;
  const Library& library_;
  const PathPolicy policy_;
  const FindCaller caller_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeSessionService(SessionRegistry& sessions, TakeStore& takes,
                                                  const Library& library, PathPolicy policy,
                                                  FindCaller caller) {
  return std::make_unique<SessionService>(sessions, takes, library, std::move(policy), std::move(caller));
}

}  // namespace weft
