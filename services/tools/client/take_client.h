// The client's side of the takes that weftd records.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "services/tools/client/daemon_call.h"
#include "weft/v1/takes.grpc.pb.h"

namespace weft {

class TakeClient : public ServiceClient<v1::Takes> {
 public:
  using Take = absl::StatusOr<v1::RecordedTake>;
  using ServiceClient::ServiceClient;

  // The request needs an idempotency key.
  Take Start(const v1::StartTakeRequest& request) { return Call(&Stub::StartTake, request); }
  Take Stop(const std::string& id) { return CallNaming(&Stub::StopTake, id); }
  // `words`: of ListTakesRequest.
  absl::StatusOr<v1::ListTakesResponse> List(int limit, bool trash = false, const std::string& words = "") {
    v1::ListTakesRequest request;
    request.set_trash(trash);
    request.set_words(words);
    constexpr int kUsual = 100;  // as the daemon's
    return CallForPages(connection_, *stub_, &Stub::ListTakes, request, limit == 0 ? kUsual : limit,
                        &v1::ListTakesResponse::takes_size);
  }
  Take Describe(const v1::DescribeTakeRequest& request) { return Call(&Stub::DescribeTake, request); }
  Take Pin(const std::string& id, bool pinned) {
    v1::PinTakeRequest request;
    request.set_take_id(id);
    request.set_pinned(pinned);
    return Call(&Stub::PinTake, request);
  }
  Take Delete(const std::string& id) { return CallNaming(&Stub::DeleteTake, id); }
  Take Restore(const std::string& id) { return CallNaming(&Stub::RestoreTake, id); }
  // Empty: all takes of the trash.
  absl::StatusOr<v1::EmptyTrashResponse> EmptyTrash(const std::string& id) {
    return CallNaming(&Stub::EmptyTrash, id);
  }
  // Calls `update` with every state until the take has ended, and returns the last one. Cancelled: `stop` was
  // requested; the take goes on. Unavailable: the daemon went away; the take goes on.
  Take Watch(const std::string& id, const std::function<void(const v1::RecordedTake&)>& update,
             const std::stop_token& stop = {}) {
    return WatchToEnd(connection_, *stub_, &Stub::WatchTake, RequestNaming<v1::WatchTakeRequest>(id), stop,
                      update, absl::StrCat("take ", id));
  }
};

}  // namespace weft
