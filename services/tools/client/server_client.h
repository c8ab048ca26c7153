// A client's calls of the service Server.
#pragma once

#include <functional>
#include <memory>

#include "services/tools/client/registration_client.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {

// Thread safety: any thread.
class ServerClient {
 public:
  // The connection must outlive the client.
  explicit ServerClient(const RegistrationClient& connection)
      : connection_(connection), stub_(v1::Server::NewStub(connection.channel())) {}

  // Drains the daemon, and returns when it has stopped. `progress` is called several times a second. Errors
  // of the first call; later ones mean that it has stopped.
  absl::Status DrainUntilItStops(const v1::DrainRequest& request,
                                 const std::function<void(const v1::DrainProgress&)>& progress);

  absl::StatusOr<v1::RetentionRehearsal> RehearseRetention(const v1::RehearseRetentionRequest& request);

 private:
  const RegistrationClient& connection_;
  const std::unique_ptr<v1::Server::Stub> stub_;
};

}  // namespace weft
