// The service Operations.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <memory>

#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/work/operation_queue.h"

namespace weft {

// Thread safety: gRPC calls from many threads. The queue must outlive the service.
std::unique_ptr<grpc::Service> MakeOperationService(OperationQueue& operations, FindCaller caller);

}  // namespace weft
