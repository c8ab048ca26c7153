// The service Server: who answers, and how busy it is.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <functional>
#include <memory>

#include "services/server/daemon/program/drain.h"
#include "services/server/daemon/work/job_queue.h"

namespace weft {

// RetentionKeeper::Rehearse.
using RetentionRehearser = std::function<v1::RetentionRehearsal(const v1::RehearseRetentionRequest&)>;

// `info` holds what does not change: version, workers, folders. Queue and drain must outlive the service.
// Thread safety: gRPC calls from many threads.
std::unique_ptr<grpc::Service> MakeServerService(JobQueue& queue, Drain& drain, v1::ServerInfo info,
                                                 RetentionRehearser rehearse);

}  // namespace weft
