// The client's side of the takes that weftd records.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "services/tools/client/registration_client.h"
#include "weft/v1/takes.grpc.pb.h"

namespace weft {

// Errors as those of RegistrationClient. Thread safety: any thread may call any function. `connection` must
// outlive it.
class TakeClient {
 public:
  explicit TakeClient(const RegistrationClient& connection)
      : connection_(connection), stub_(v1::Takes::NewStub(connection.channel())) {}

  // The request needs an idempotency key.
  absl::StatusOr<v1::RecordedTake> Start(const v1::StartTakeRequest& request);
  absl::StatusOr<v1::RecordedTake> Stop(const std::string& id);
  // `words`: of ListTakesRequest.
  absl::StatusOr<v1::ListTakesResponse> List(int limit, bool trash = false, const std::string& words = "");
  absl::StatusOr<v1::RecordedTake> Describe(const v1::DescribeTakeRequest& request);
  absl::StatusOr<v1::RecordedTake> Pin(const std::string& id, bool pinned);
  absl::StatusOr<v1::RecordedTake> Delete(const std::string& id);
  absl::StatusOr<v1::RecordedTake> Restore(const std::string& id);
  // Empty: all takes of the trash.
  absl::StatusOr<v1::EmptyTrashResponse> EmptyTrash(const std::string& id);
  // Calls `update` with every state until the take has ended, and returns the last one. Cancelled: `stop` was
  // requested; the take goes on. Unavailable: the daemon went away; the take goes on.
  absl::StatusOr<v1::RecordedTake> Watch(const std::string& id,
                                         const std::function<void(const v1::RecordedTake&)>& update,
                                         std::stop_token stop = {});

 private:
  const RegistrationClient& connection_;
  const std::unique_ptr<v1::Takes::Stub> stub_;
};

}  // namespace weft
