#include "services/server/daemon/door/call_observer.h"

#include <google/protobuf/message.h>

#include <chrono>

#include "capture/file/plain_text.h"
#include "services/server/access/audit_fields.h"
#include "services/server/daemon/door/call_identity.h"
#include "services/server/rpc/grpc_status.h"

namespace weft {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerRpcInfo;

// gRPC hands messages on without their type. Generated messages have Message at their beginning; those of
// health are raw bytes instead, so this is for methods of ours.
const google::protobuf::Message& AsMessage(const void* message) {
  return *static_cast<const google::protobuf::Message*>(message);
}

class CallObserver final : public grpc::experimental::Interceptor {
 public:
  CallObserver(const CallerSources& sources, ServerRpcInfo* info)
      : sources_(sources), info_(info), method_(MethodOf(info->method())) {}

  // Also of calls whose client went away.
  ~CallObserver() override {
    if (!began_) return;
    if (awaits_) sources_.guard.Drained(connection_);
    sources_.limits.End(account_, method_.kind);
    const ObservedCall call{method_, entry_.outcome().empty() ? "CANCELLED" : entry_.outcome(),
                            std::chrono::steady_clock::now() - start_};
    if (sources_.ended) sources_.ended(call);
    entry_.set_method(method_.name);
    entry_.set_outcome(call.outcome);
    if (method_.audited) {
      sources_.audit.Record(entry_);
      return;
    }
    // Reads are not recorded, but who held one open and took nothing.
    const bool was_let_go = call.outcome == absl::StatusCodeToString(absl::StatusCode::kDeadlineExceeded);
    if (was_let_go && method_.kind == CallKind::kStream) sources_.audit.Refused(entry_);
  }

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) Begin();
    if (method_.is_ours && methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_MESSAGE) &&
        methods->GetRecvMessage() != nullptr)
      HeardMessage(AsMessage(methods->GetRecvMessage()));
    // One message of several tells what a stream is about.
    if (method_.audited && methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_MESSAGE) &&
        methods->GetRecvMessage() != nullptr && entry_.about().empty())
      DescribeRequest(AsMessage(methods->GetRecvMessage()), entry_);
    if (method_.audited && methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_MESSAGE) &&
        methods->GetSendMessage() != nullptr)
      DescribeAnswer(AsMessage(methods->GetSendMessage()), entry_);
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS))
      End(methods->GetSendStatus());
    methods->Proceed();
  }

 private:
  void Begin() {
    grpc::ServerContextBase& context = *info_->server_context();
    entry_.set_caller(EscapedText(CallerOf(context, sources_.access).name));
    entry_.set_peer(EscapedText(PeerNameOf(*context.auth_context())));
    connection_ = context.peer();
    sources_.guard.HeardCall(connection_);
    awaits_ = true;
    account_ = AccountOf(entry_.caller(), entry_.peer());
    sources_.limits.Begin(account_, method_.kind);
    began_ = true;
  }

  void HeardMessage(const google::protobuf::Message& message) {
    sources_.guard.HeardMessage(connection_, message.ByteSizeLong());
    if (method_.kind == CallKind::kUpload || !awaits_) return;
    awaits_ = false;
    sources_.guard.Drained(connection_);
  }

  void End(const grpc::Status& status) {
    const absl::Status ours = FromGrpcStatus(status);
    entry_.set_outcome(absl::StatusCodeToString(ours.code()));
    entry_.set_message(EscapedText(std::string(ours.message())));
  }

  const CallerSources& sources_;
  ServerRpcInfo* const info_;
  const Method method_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::string account_, connection_;
  bool began_ = false;
  bool awaits_ = false;  // messages
  v1::AuditEntry entry_;
};

class CallObservers final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit CallObservers(const CallerSources& sources) : sources_(sources) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(ServerRpcInfo* info) override {
    return new CallObserver(sources_, info);
  }

 private:
  const CallerSources sources_;
};

}  // namespace

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> ObserveCalls(
    const CallerSources& sources) {
  return std::make_unique<CallObservers>(sources);
}

Caller CallerOf(const grpc::ServerContextBase& context, AccessControl& access) {
  return access.Identify(CredentialsOf(context.client_metadata(), *context.auth_context()))
      .value_or(Caller());
}

}  // namespace weft
