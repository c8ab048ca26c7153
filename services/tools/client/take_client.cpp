#include "services/tools/client/take_client.h"

#include <grpcpp/grpcpp.h>

#include "absl/strings/str_cat.h"
#include "services/tools/client/daemon_call.h"

namespace weft {
absl::StatusOr<v1::RecordedTake> TakeClient::Start(const v1::StartTakeRequest& request) {
  return CallDaemon<v1::RecordedTake>(connection_,
                                      [&](grpc::ClientContext* context, v1::RecordedTake* answer) {
                                        return stub_->StartTake(context, request, answer);
                                      });
}

absl::StatusOr<v1::RecordedTake> TakeClient::Stop(const std::string& id) {
  v1::StopTakeRequest request;
  request.set_take_id(id);
  return CallDaemon<v1::RecordedTake>(connection_,
                                      [&](grpc::ClientContext* context, v1::RecordedTake* answer) {
                                        return stub_->StopTake(context, request, answer);
                                      });
}

absl::StatusOr<v1::ListTakesResponse> TakeClient::List(int limit, bool trash, const std::string& words) {
  v1::ListTakesRequest request;
  request.set_trash(trash);
  request.set_words(words);
  constexpr int kUsual = 100;  // as the daemon's
  return CallForPages<v1::ListTakesResponse>(
      connection_, request, limit == 0 ? kUsual : limit,
      [&](grpc::ClientContext* context, const v1::ListTakesRequest& asked, v1::ListTakesResponse* answer) {
        return stub_->ListTakes(context, asked, answer);
      },
      [](const v1::ListTakesResponse& answer) { return answer.takes_size(); });
}

absl::StatusOr<v1::RecordedTake> TakeClient::Describe(const v1::DescribeTakeRequest& request) {
  return CallDaemon<v1::RecordedTake>(connection_,
                                      [&](grpc::ClientContext* context, v1::RecordedTake* answer) {
                                        return stub_->DescribeTake(context, request, answer);
                                      });
}

absl::StatusOr<v1::RecordedTake> TakeClient::Pin(const std::string& id, bool pinned) {
  v1::PinTakeRequest request;
  request.set_take_id(id);
  request.set_pinned(pinned);
  return CallDaemon<v1::RecordedTake>(connection_,
                                      [&](grpc::ClientContext* context, v1::RecordedTake* answer) {
                                        return stub_->PinTake(context, request, answer);
                                      });
}

absl::StatusOr<v1::RecordedTake> TakeClient::Delete(const std::string& id) {
  v1::DeleteTakeRequest request;
  request.set_take_id(id);
  return CallDaemon<v1::RecordedTake>(connection_,
                                      [&](grpc::ClientContext* context, v1::RecordedTake* answer) {
                                        return stub_->DeleteTake(context, request, answer);
                                      });
}

absl::StatusOr<v1::RecordedTake> TakeClient::Restore(const std::string& id) {
  v1::RestoreTakeRequest request;
  request.set_take_id(id);
  return CallDaemon<v1::RecordedTake>(connection_,
                                      [&](grpc::ClientContext* context, v1::RecordedTake* answer) {
                                        return stub_->RestoreTake(context, request, answer);
                                      });
}

absl::StatusOr<v1::EmptyTrashResponse> TakeClient::EmptyTrash(const std::string& id) {
  v1::EmptyTrashRequest request;
  request.set_take_id(id);
  return CallDaemon<v1::EmptyTrashResponse>(
      connection_, [&](grpc::ClientContext* context, v1::EmptyTrashResponse* answer) {
        return stub_->EmptyTrash(context, request, answer);
      });
}

absl::StatusOr<v1::RecordedTake> TakeClient::Watch(const std::string& id,
                                                   const std::function<void(const v1::RecordedTake&)>& update,
                                                   std::stop_token stop) {
  v1::WatchTakeRequest request;
  request.set_take_id(id);
  v1::RecordedTake take;
  const grpc::Status status = CallWhenAdmitted([&] {
    grpc::ClientContext context;
    const std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
    const auto stream = stub_->WatchTake(&context, request);
    while (stream->Read(&take)) {
      if (update) update(take);
    }
    return stream->Finish();
  });
  if (status.ok()) return take;
  if (stop.stop_requested()) {
    return absl::CancelledError(
        absl::StrCat("stopped watching; take ", id, " goes on at ", connection_.server()));
  }
  return connection_.Explain(status);
}

}  // namespace weft
