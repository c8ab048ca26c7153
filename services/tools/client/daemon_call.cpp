#include "services/tools/client/daemon_call.h"

#include <random>

#include "services/server/rpc/retry_after.h"

namespace weft {

std::optional<std::chrono::milliseconds> PauseAfter(const grpc::Status& status) {
  if (status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED &&
      status.error_code() != grpc::StatusCode::UNAVAILABLE)
    return std::nullopt;
  const std::optional<std::chrono::milliseconds> least = RetryAfter(status.error_message());
  if (!least) return std::nullopt;
  thread_local std::minstd_rand random{std::random_device()()};
  return *least +
         std::chrono::milliseconds(std::uniform_int_distribution<int64_t>(1, 50 + least->count())(random));
}

}  // namespace weft
