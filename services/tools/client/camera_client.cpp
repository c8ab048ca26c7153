#include "services/tools/client/camera_client.h"

#include <grpcpp/grpcpp.h>

#include <chrono>

#include "services/tools/client/daemon_call.h"

namespace weft {

absl::StatusOr<v1::CameraList> CameraClient::List() {
  return CallDaemon(connection_, *stub_, &v1::Cameras::Stub::ListCameras, v1::ListCamerasRequest());
}

absl::StatusOr<std::vector<v1::CameraLook>> CameraClient::Look(const v1::LookAtCamerasRequest& request) {
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

}  // namespace weft
