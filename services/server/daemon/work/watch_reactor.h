// WatchJob without a thread per watcher.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <string>

#include "services/server/daemon/calls/stall_watch.h"
#include "services/server/daemon/work/job_queue.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Streams the job's news; deletes itself when the stream has ended, also when the client has gone or takes no
// news for `patience`. The queue must outlive the server.
grpc::ServerWriteReactor<v1::JobUpdate>* WatchJob(
    grpc::CallbackServerContext* context, JobQueue& queue, const std::string& job_id,
    std::chrono::milliseconds patience = StallWatch::kReadTimeout);

}  // namespace weft
