// How every service of the daemon runs its handlers.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <functional>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

using CallContext = grpc::ServerContext;

// What is thrown ends the call, not the daemon: ResourceExhausted without memory or threads, Internal
// otherwise. Errors go to the log under the method's name.
grpc::Status Answer(const char* method, const std::function<absl::Status()>& handler);

template <typename Message>
absl::Status Assign(absl::StatusOr<Message> result, Message* message) {
  if (result.ok()) *message = *std::move(result);
  return result.status();
}

}  // namespace weft
