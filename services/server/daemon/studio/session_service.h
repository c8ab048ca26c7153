// The service Sessions.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <memory>

#include "services/server/daemon/calls/path_policy.h"
#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/studio/session_registry.h"
#include "services/server/daemon/studio/take_store.h"
#include "services/server/library/library.h"

namespace weft {

// Thread safety: gRPC calls from many threads. Registries and library must outlive the service.
std::unique_ptr<grpc::Service> MakeSessionService(SessionRegistry& sessions, TakeStore& takes,
                                                  const Library& library, PathPolicy policy,
                                                  FindCaller caller);

}  // namespace weft
