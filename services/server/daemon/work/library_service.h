// The service Library: uploads, lists and downloads of items.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <memory>

#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/operation_queue.h"
#include "services/server/library/library.h"
#include "services/server/library/uploads.h"

namespace weft {

// Errors as library.proto says. Queues, library and uploads must outlive the service. Thread safety: gRPC
// calls from many threads.
std::unique_ptr<grpc::Service> MakeLibraryService(JobQueue& queue, OperationQueue& operations,
                                                  Library& library, Uploads& uploads, FindCaller caller);

}  // namespace weft
