// Meshes of jobs for pages that draw them.
#pragma once

#include "services/server/console/awaitable.h"

#include <atomic>
#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <string>

#include "services/server/console/daemon_calls.h"
#include "services/server/console/http_exchange.h"

namespace weft {

// Thread safety: any thread.
class MeshDownloads {
 public:
  // Waits for what is being encoded, and encodes nothing more.
  void Stop();

  // `job_and_frame` is "JOB/FRAME"; the answer is a QuantizedMesh of the mesh that the query names
  // (mesh=NAME), with faces where it says faces=1. It is asked for as any result, so the API's role, audit
  // and errors hold. ResourceExhausted: meshes that are on their way take 512 MiB together.
  boost::asio::awaitable<void> Send(HttpExchange& exchange, std::string job_and_frame, CallFor caller,
                                    DaemonCalls& calls);

 private:
  boost::asio::thread_pool encoder_{1};  // pictures and streams do not wait for it
  std::atomic<int64_t> held_bytes_ = 0;
};

}  // namespace weft
