// The service Jobs: requests checked, then handed to the queue.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <memory>
#include <string>

#include "services/server/daemon/calls/path_policy.h"
#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/prepare_job.h"
#include "services/server/library/library.h"

namespace weft {

struct JobServiceParts {
  JobQueue& queue;
  Library& library;
  PathPolicy policy;
  ResolveInput resolve;
  std::string results_folder;  // of jobs whose results go nowhere else: <results_folder>/<id>
  InputsLoader load;
  FindCaller caller;
};

// Errors as jobs.proto says. Queue and library must outlive the service. Thread safety: gRPC calls from many
// threads.
std::unique_ptr<grpc::Service> MakeJobService(JobServiceParts parts);

}  // namespace weft
