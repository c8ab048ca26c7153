// WatchJob without a thread per watcher.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <string>

#include "services/daemon/job_queue.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Streams the job's news; deletes itself when the stream has ended, also when the client has gone. The queue
// must outlive the server.
grpc::ServerWriteReactor<v1::JobUpdate>* WatchJob(JobQueue& queue, const std::string& job_id);

}  // namespace weft
