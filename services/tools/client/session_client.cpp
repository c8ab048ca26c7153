#include "services/tools/client/session_client.h"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>

#include "base/mutex.h"

namespace weft {

absl::Status SessionClient::Hold(const v1::CaptureSession& session, const std::string& lease,
                                 const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  const std::chrono::duration<double> lease_time(session.lease_s());
  Mutex mutex;
  std::condition_variable_any asked;
  MutexLock lock(mutex);
  for (Clock::time_point renewed = Clock::now();;) {
    asked.wait_for(lock, stop, lease_time / 3, [] { return false; });
    if (stop.stop_requested()) return absl::OkStatus();
    const absl::Status status = Renew(lease).status();
    if (status.ok()) {
      renewed = Clock::now();
    } else if (!absl::IsUnavailable(status) || Clock::now() - renewed > lease_time) {
      return status;
    }
  }
}

}  // namespace weft
