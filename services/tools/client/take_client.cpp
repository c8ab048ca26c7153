#include "services/tools/client/take_client.h"

#include <grpcpp/grpcpp.h>

#include "absl/strings/str_cat.h"
#include "services/tools/client/daemon_call.h"

namespace weft {
absl::StatusOr<v1::RecordedTake> TakeClient::Start(const v1::StartTakeRequest& request) {
  return CallDaemon(connection_, *stub_, &v1::Takes::Stub::StartTake, request);
}

absl::StatusOr<v1::RecordedTake> TakeClient::Stop(const std::string& id) {
  return CallDaemon(connection_, *stub_, &v1::Takes::Stub::StopTake, RequestNaming<v1::StopTakeRequest>(id));
}

absl::StatusOr<v1::ListTakesResponse> TakeClient::List(int limit, bool trash, const std::string& words) {
  v1::ListTakesRequest request;
  request.set_trash(trash);
  request.set_words(words);
  constexpr int kUsual = 100;  // as the daemon's
  return CallForPages(connection_, *stub_, &v1::Takes::Stub::ListTakes, request, limit == 0 ? kUsual : limit,
                      &v1::ListTakesResponse::takes_size);
}

absl::StatusOr<v1::RecordedTake> TakeClient::Describe(const v1::DescribeTakeRequest& request) {
  return CallDaemon(connection_, *stub_, &v1::Takes::Stub::DescribeTake, request);
}

absl::StatusOr<v1::RecordedTake> TakeClient::Pin(const std::string& id, bool pinned) {
  v1::PinTakeRequest request;
  request.set_take_id(id);
  request.set_pinned(pinned);
  return CallDaemon(connection_, *stub_, &v1::Takes::Stub::PinTake, request);
}

absl::StatusOr<v1::RecordedTake> TakeClient::Delete(const std::string& id) {
  return CallDaemon(connection_, *stub_, &v1::Takes::Stub::DeleteTake,
                    RequestNaming<v1::DeleteTakeRequest>(id));
}

absl::StatusOr<v1::RecordedTake> TakeClient::Restore(const std::string& id) {
  return CallDaemon(connection_, *stub_, &v1::Takes::Stub::RestoreTake,
                    RequestNaming<v1::RestoreTakeRequest>(id));
}

absl::StatusOr<v1::EmptyTrashResponse> TakeClient::EmptyTrash(const std::string& id) {
  return CallDaemon(connection_, *stub_, &v1::Takes::Stub::EmptyTrash,
                    RequestNaming<v1::EmptyTrashRequest>(id));
}

absl::StatusOr<v1::RecordedTake> TakeClient::Watch(const std::string& id,
                                                   const std::function<void(const v1::RecordedTake&)>& update,
                                                   std::stop_token stop) {
  return WatchToEnd(connection_, *stub_, &v1::Takes::Stub::WatchTake, RequestNaming<v1::WatchTakeRequest>(id),
                    stop, update, absl::StrCat("take ", id));
}

}  // namespace weft
