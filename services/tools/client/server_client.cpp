#include "services/tools/client/server_client.h"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <thread>

namespace weft {

absl::Status ServerClient::DrainUntilItStops(const v1::DrainRequest& request,
                                             const std::function<void(const v1::DrainProgress&)>& progress) {
  constexpr std::chrono::milliseconds kPeriod{300};
  constexpr std::chrono::seconds kCallTimeout{10};
  for (bool has_begun = false;; has_begun = true) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kCallTimeout);
    v1::DrainProgress state;
    const grpc::Status status = stub_->Drain(&context, request, &state);
    const bool has_stopped = status.error_code() == grpc::StatusCode::UNAVAILABLE ||
                             status.error_code() == grpc::StatusCode::CANCELLED;
    if (has_begun && has_stopped) return absl::OkStatus();
    if (!status.ok()) return connection_.Explain(status);
    progress(state);
    std::this_thread::sleep_for(kPeriod);
  }
}

}  // namespace weft
