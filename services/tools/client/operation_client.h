// The client's side of the operations of weftd.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "services/tools/client/daemon_call.h"
#include "weft/v1/operations.grpc.pb.h"

namespace weft {

class OperationClient : public ServiceClient<v1::Operations> {
 public:
  using Operation = absl::StatusOr<v1::Operation>;
  using ServiceClient::ServiceClient;

  // The request needs an idempotency key.
  Operation Start(const v1::StartOperationRequest& request) { return Call(&Stub::StartOperation, request); }
  absl::StatusOr<v1::ListOperationsResponse> List(int limit) {
    return CallForPages(connection_, *stub_, &Stub::ListOperations, v1::ListOperationsRequest(), limit,
                        &v1::ListOperationsResponse::operations_size);
  }
  Operation Cancel(const std::string& id) { return CallNaming(&Stub::CancelOperation, id); }
  // With its files. It must have ended.
  Operation Delete(const std::string& id) { return CallNaming(&Stub::DeleteOperation, id); }
  // Calls `update` with every state until it has ended, and returns the last one. Cancelled: `stop` was
  // requested; the operation goes on. Unavailable: the daemon went away; the operation begins anew with the
  // next one.
  Operation Watch(const std::string& id, const std::function<void(const v1::Operation&)>& update,
                  const std::stop_token& stop = {}) {
    return WatchToEnd(connection_, *stub_, &Stub::WatchOperation,
                      RequestNaming<v1::WatchOperationRequest>(id), stop, update,
                      absl::StrCat("operation ", id));
  }
  // Everything that it wrote, into this folder, which is made where it is missing.
  absl::Status FetchFiles(const std::string& id, const std::string& folder,
                          const std::function<void(size_t done, size_t total)>& progress);
};

}  // namespace weft
