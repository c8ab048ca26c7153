// The service Cameras.
#pragma once

#include <vector>

#include "services/server/daemon/studio/session_registry.h"
#include "services/server/daemon/studio/take_store.h"
#include "weft/v1/cameras.grpc.pb.h"

namespace weft {

// Thread safety: gRPC calls from many threads. The keepers must outlive the service.
class CameraService final : public v1::Cameras::Service {
 public:
  CameraService(TakeStore& takes, SessionRegistry& sessions) : takes_(takes), sessions_(sessions) {}

  grpc::Status ListCameras(grpc::ServerContext* context, const v1::ListCamerasRequest* request,
                           v1::CameraList* list) override;
  grpc::Status LookAtCameras(grpc::ServerContext* context, const v1::LookAtCamerasRequest* request,
                             grpc::ServerWriter<v1::CameraLook>* writer) override;

 private:
  absl::StatusOr<std::vector<v1::CameraLook>> Look(const v1::LookAtCamerasRequest& request);
  // What of the request is to be opened.
  absl::StatusOr<v1::Session> SessionOf(const v1::LookAtCamerasRequest& request);

  TakeStore& takes_;
  SessionRegistry& sessions_;
};

}  // namespace weft
