// A client's calls of the service Server.
#pragma once

#include <functional>

#include "services/tools/client/daemon_call.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {

class ServerClient : public ServiceClient<v1::Server> {
 public:
  using ServiceClient::ServiceClient;

  // Drains the daemon, and returns when it has stopped. `progress` is called several times a second. Errors
  // of the first call; later ones mean that it has stopped.
  absl::Status DrainUntilItStops(const v1::DrainRequest& request,
                                 const std::function<void(const v1::DrainProgress&)>& progress);

  absl::StatusOr<v1::RetentionRehearsal> RehearseRetention(const v1::RehearseRetentionRequest& request) {
    return CallDaemonOnce(connection_, *stub_, &Stub::RehearseRetention, request, std::chrono::seconds(60));
  }
};

}  // namespace weft
