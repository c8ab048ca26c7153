// The client's side of the operations of weftd.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/tools/client/registration_client.h"
#include "weft/v1/operations.grpc.pb.h"

namespace weft {

// Errors as those of RegistrationClient. Thread safety: any thread may call any function. `connection` must
// outlive it.
class OperationClient {
 public:
  explicit OperationClient(const RegistrationClient& connection)
      : connection_(connection), stub_(v1::Operations::NewStub(connection.channel())) {}

  // The request needs an idempotency key.
  absl::StatusOr<v1::Operation> Start(const v1::StartOperationRequest& request);
  absl::StatusOr<v1::ListOperationsResponse> List(int limit);
  absl::StatusOr<v1::Operation> Cancel(const std::string& id);
  // With its files. It must have ended.
  absl::StatusOr<v1::Operation> Delete(const std::string& id);
  // Calls `update` with every state until it has ended, and returns the last one. Cancelled: `stop` was
  // requested; the operation goes on. Unavailable: the daemon went away; the operation begins anew with the
  // next one.
  absl::StatusOr<v1::Operation> Watch(const std::string& id,
                                      const std::function<void(const v1::Operation&)>& update,
                                      std::stop_token stop = {});
  // Everything that it wrote, into this folder, which is made where it is missing.
  absl::Status FetchFiles(const std::string& id, const std::string& folder,
                          const std::function<void(size_t done, size_t total)>& progress);

 private:
  const RegistrationClient& connection_;
  const std::unique_ptr<v1::Operations::Stub> stub_;
};

}  // namespace weft
