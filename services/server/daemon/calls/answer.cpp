#include "services/server/daemon/calls/answer.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <exception>

#include "capture/file/plain_text.h"
#include "services/ground/process/no_threads.h"
#include "services/server/rpc/grpc_status.h"
#include "services/server/rpc/retry_after.h"

namespace weft {

grpc::Status Answer(const char* method, const std::function<absl::Status()>& handler) {
  absl::Status status;
  try {
    status = handler();
  } catch (const std::bad_alloc&) {
    status = absl::ResourceExhaustedError("the daemon is out of memory");
  } catch (const std::exception& error) {
    constexpr std::chrono::seconds kRetry{2};
    status = IsLackOfThreads(error) ? RetryLater(absl::StatusCode::kResourceExhausted,
                                                 std::string(NoFurtherThreads().message()), kRetry)
                                    : absl::InternalError(error.what());
  }
  if (!status.ok()) {
    // Without payloads, which ToString would print as bytes. A message quotes what clients sent.
    constexpr size_t kLongestLogged = 500;
    spdlog::info("{}: {}: {}", method, absl::StatusCodeToString(status.code()),
                 EscapedText(std::string(status.message().substr(0, kLongestLogged))));
  }
  return ToGrpcStatus(status);
}

}  // namespace weft
