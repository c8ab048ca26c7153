// The client's side of the cameras of weftd.
#pragma once

#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "services/tools/client/registration_client.h"
#include "weft/v1/cameras.grpc.pb.h"

namespace weft {

// Errors as those of RegistrationClient. Thread safety: any thread may call any function. `connection` must
// outlive it.
class CameraClient {
 public:
  explicit CameraClient(const RegistrationClient& connection)
      : connection_(connection), stub_(v1::Cameras::NewStub(connection.channel())) {}

  absl::StatusOr<v1::CameraList> List();
  absl::StatusOr<std::vector<v1::CameraLook>> Look(const v1::LookAtCamerasRequest& request);

 private:
  const RegistrationClient& connection_;
  const std::unique_ptr<v1::Cameras::Stub> stub_;
};

}  // namespace weft
