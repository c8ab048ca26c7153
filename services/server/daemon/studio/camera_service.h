// The service Cameras.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <memory>

#include "services/server/daemon/studio/session_registry.h"
#include "services/server/daemon/studio/take_store.h"

namespace weft {

// Thread safety: gRPC calls from many threads. Store and registry must outlive the service.
std::unique_ptr<grpc::Service> MakeCameraService(TakeStore& takes, SessionRegistry& sessions);

}  // namespace weft
