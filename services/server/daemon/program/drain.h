// The end of a daemon that is to be updated or moved: no new work, what runs ends, then it stops.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "absl/status/status.h"
#include "base/mutex.h"
#include "services/server/daemon/work/job_queue.h"
#include "weft/v1/server.pb.h"

namespace weft {

// Thread safety: any thread.
class Drain {
 public:
  // `drained` is called once, by a thread of the drain, when nothing that it waits for runs any more.
  explicit Drain(std::function<void()> drained) : drained_(std::move(drained)) {}

  // OK, or Unavailable with the remedy while the daemon drains: asked before new work is taken.
  absl::Status Admit() const;
  // Begins it, or says how far it is.
  v1::DrainProgress Begin(JobQueue& queue, const v1::DrainRequest& request);
  // Waits for nothing any more.
  void Stop();

 private:
  void Watch(JobQueue& queue, const std::stop_token& stop) const;

  const std::function<void()> drained_;
  std::atomic<bool> draining_ = false;
  Mutex mutex_;
  std::jthread watch_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace weft
