#include "services/client/take_client.h"

#include <grpcpp/grpcpp.h>

#include <chrono>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

void SetTakePatience(grpc::ClientContext& context) {
  constexpr std::chrono::seconds kPatience{60};
  context.set_deadline(std::chrono::system_clock::now() + kPatience);
}

}  // namespace

absl::StatusOr<v1::RecordedTake> TakeClient::Start(const v1::StartTakeRequest& request) {
  grpc::ClientContext context;
  SetTakePatience(context);
  v1::RecordedTake take;
  const grpc::Status status = stub_->StartTake(&context, request, &take);
  if (!status.ok()) return connection_.Explain(status);
  return take;
}

absl::StatusOr<v1::RecordedTake> TakeClient::Stop(const std::string& id) {
  grpc::ClientContext context;
  SetTakePatience(context);
  v1::StopTakeRequest request;
  request.set_take_id(id);
  v1::RecordedTake take;
  const grpc::Status status = stub_->StopTake(&context, request, &take);
  if (!status.ok()) return connection_.Explain(status);
  return take;
}

absl::StatusOr<v1::ListTakesResponse> TakeClient::List(int limit) {
  grpc::ClientContext context;
  SetTakePatience(context);
  v1::ListTakesRequest request;
  request.set_limit(limit);
  v1::ListTakesResponse response;
  const grpc::Status status = stub_->ListTakes(&context, request, &response);
  if (!status.ok()) return connection_.Explain(status);
  return response;
}

absl::StatusOr<v1::RecordedTake> TakeClient::Watch(const std::string& id,
                                                   const std::function<void(const v1::RecordedTake&)>& update,
                                                   std::stop_token stop) {
  grpc::ClientContext context;
  const std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
  v1::WatchTakeRequest request;
  request.set_take_id(id);
  const auto stream = stub_->WatchTake(&context, request);
  v1::RecordedTake take;
  while (stream->Read(&take)) {
    if (update) update(take);
  }
  const grpc::Status status = stream->Finish();
  if (status.ok()) return take;
  if (stop.stop_requested()) {
    return absl::CancelledError(
        absl::StrCat("stopped watching; take ", id, " goes on at ", connection_.server()));
  }
  return connection_.Explain(status);
}

}  // namespace weft
