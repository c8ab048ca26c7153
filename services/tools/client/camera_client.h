// The client's side of the cameras of weftd.
#pragma once

#include <chrono>
#include <vector>

#include "absl/status/statusor.h"
#include "services/tools/client/daemon_call.h"
#include "weft/v1/cameras.grpc.pb.h"

namespace weft {

class CameraClient : public ServiceClient<v1::Cameras> {
 public:
  using ServiceClient::ServiceClient;

  absl::StatusOr<v1::CameraList> List() { return Call(&Stub::ListCameras, v1::ListCamerasRequest()); }
  absl::StatusOr<std::vector<v1::CameraLook>> Look(const v1::LookAtCamerasRequest& request) {
    grpc::ClientContext context;
    constexpr std::chrono::minutes kOpenTimeout{3};  // cameras may take long to open
    context.set_deadline(std::chrono::system_clock::now() + kOpenTimeout);
    std::vector<v1::CameraLook> looks;
    const auto stream = stub_->LookAtCameras(&context, request);
    for (v1::CameraLook look; stream->Read(&look);) looks.push_back(look);
    const grpc::Status status = stream->Finish();
    if (!status.ok()) return connection_.Explain(status);
    return looks;
  }
};

}  // namespace weft
