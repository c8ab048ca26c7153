// The service Takes.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <memory>

#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/studio/session_registry.h"
#include "services/server/daemon/studio/take_store.h"
#include "services/server/daemon/work/job_queue.h"

namespace weft {

// Thread safety: gRPC calls from many threads. Stores and queue must outlive the service.
std::unique_ptr<grpc::Service> MakeTakeService(TakeStore& takes, SessionRegistry& sessions, JobQueue& jobs,
                                               FindCaller caller);

}  // namespace weft
