#include "services/server/daemon/work/watch_reactor.h"

#include <memory>
#include <utility>

#include "base/mutex.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/rpc/grpc_status.h"

namespace weft {
namespace {

class WatchReactor;

// What the queue calls. Outlives the reactor when a call is under way while the stream ends.
struct Bell {
  Mutex mutex;
  WatchReactor* reactor ABSL_GUARDED_BY(mutex) = nullptr;
};

// At most one write is under way; news that come meanwhile are gathered by the queue into the next one, so a
// slow client costs no memory.
class WatchReactor : public grpc::ServerWriteReactor<v1::JobUpdate> {
 public:
  WatchReactor(grpc::CallbackServerContext* context, JobQueue& queue, std::chrono::milliseconds patience)
      : queue_(queue), stalls_(context, patience) {
    stalls_.Rest();
  }

  void Begin(const std::string& job_id) {
    const MutexLock lock(bell_->mutex);
    absl::Status status = CheckJobId(job_id);
    if (status.ok()) {
      const auto watcher = queue_.Subscribe(job_id, [bell = bell_] {
        const MutexLock ring(bell->mutex);
        if (bell->reactor != nullptr) bell->reactor->Rung();
      });
      status = watcher.status();
      if (watcher.ok()) watcher_ = *watcher;
    }
    if (!status.ok()) return End(ToGrpcStatus(status));
    bell_->reactor = this;
    WriteUpdates();
  }

  void OnWriteDone(bool ok) override {
    const MutexLock lock(bell_->mutex);
    writing_ = false;
    stalls_.Rest();
    if (finished_) return;
    if (!ok || cancelled_) return End(stalls_.StatusOfFailure());
    if (last_written_) return End(grpc::Status::OK);
    WriteUpdates();
  }

  void OnCancel() override {
    const MutexLock lock(bell_->mutex);
    cancelled_ = true;
    if (!writing_) End(grpc::Status::CANCELLED);  // otherwise the end of the write ends it
  }

  void OnDone() override {
    int64_t watcher = 0;
    {
      const MutexLock lock(bell_->mutex);
      bell_->reactor = nullptr;
      watcher = watcher_;
    }
    if (watcher != 0) queue_.Unsubscribe(watcher);
    delete this;
  }

 private:
  // By a bell that is held, which is this one's.
  void Rung() {
    bell_->mutex.AssertHeld();
    WriteUpdates();
  }

  void WriteUpdates() ABSL_EXCLUSIVE_LOCKS_REQUIRED(bell_->mutex) {
    if (writing_ || finished_) return;
    JobQueue::Updates updates = queue_.PollUpdates(watcher_);
    if (updates.stopping) {
      return End({grpc::StatusCode::UNAVAILABLE, "the daemon is shutting down"});
    }
    if (!updates.update) return;
    update_ = *std::move(updates.update);
    last_written_ = updates.ended;
    writing_ = true;
    stalls_.Moved();
    StartWrite(&update_);
  }

  void End(const grpc::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(bell_->mutex) {
    if (std::exchange(finished_, true)) return;
    Finish(status);
  }

  JobQueue& queue_;
  StallWatch stalls_;
  const std::shared_ptr<Bell> bell_ = std::make_shared<Bell>();
  int64_t watcher_ ABSL_GUARDED_BY(bell_->mutex) = 0;
  v1::JobUpdate update_ ABSL_GUARDED_BY(bell_->mutex);
  bool writing_ ABSL_GUARDED_BY(bell_->mutex) = false;
  bool last_written_ ABSL_GUARDED_BY(bell_->mutex) = false;
  bool cancelled_ ABSL_GUARDED_BY(bell_->mutex) = false;
  bool finished_ ABSL_GUARDED_BY(bell_->mutex) = false;
};

}  // namespace

grpc::ServerWriteReactor<v1::JobUpdate>* WatchJob(grpc::CallbackServerContext* context, JobQueue& queue,
                                                  const std::string& job_id,
                                                  std::chrono::milliseconds patience) {
  auto* reactor = new WatchReactor(context, queue, patience);
  reactor->Begin(job_id);
  return reactor;
}

}  // namespace weft
