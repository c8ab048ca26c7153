#include "services/server/daemon/program/drain.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <condition_variable>

#include "base/mutex.h"
#include "services/server/rpc/error_detail.h"

namespace weft {
namespace {

v1::DrainProgress ProgressOf(const JobQueue::DrainState& state) {
  v1::DrainProgress progress;
  progress.set_tasks_running(state.tasks);
  progress.set_frames_running(state.frames);
  progress.set_jobs_unfinished(state.jobs);
  progress.set_drained(state.is_drained);
  return progress;
}

}  // namespace

absl::Status Drain::Admit() const {
  if (!draining_) return absl::OkStatus();
  return FieldError(absl::StatusCode::kUnavailable,
                    {"daemon", "takes no new work: it is about to stop, for example for an update",
                     "try again in a minute; what was submitted goes on when it is back"});
}

v1::DrainProgress Drain::Begin(JobQueue& queue, const v1::DrainRequest& request) {
  const MutexLock lock(mutex_);
  draining_ = true;
  const JobQueue::DrainState state = queue.Drain(request.finish_jobs());
  if (!watch_.joinable()) {
    spdlog::info("draining: no new jobs, takes and operations; {}",
                 request.finish_jobs() ? "the jobs end first" : "the frames that workers are at end first");
    watch_ = std::jthread([this, &queue](const std::stop_token& stop) { Watch(queue, stop); });
  }
  return ProgressOf(state);
}

void Drain::Watch(JobQueue& queue, const std::stop_token& stop) const {
  constexpr std::chrono::milliseconds kPeriod{200};
  Mutex mutex;
  std::condition_variable_any asked;
  MutexLock lock(mutex);
  while (!stop.stop_requested() && !queue.CurrentDrain().is_drained)
    asked.wait_for(lock, stop, kPeriod, [] { return false; });
  if (stop.stop_requested()) return;
  spdlog::info("drained");
  if (drained_) drained_();
}

void Drain::Stop() {
  const MutexLock lock(mutex_);
  watch_ = {};
}

}  // namespace weft
