#include "services/server/daemon/work/watch_reactor.h"

#include <memory>
#include <mutex>
#include <utility>

#include "services/server/daemon/calls/request_check.h"
#include "services/server/rpc/grpc_status.h"

namespace weft {
namespace {

class WatchReactor;

// What the queue calls. Outlives the reactor when a call is under way while the stream ends.
struct Bell {
  std::mutex mutex;
  WatchReactor* reactor = nullptr;
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
    const std::lock_guard lock(bell_->mutex);
    absl::Status status = CheckJobId(job_id);
    if (status.ok()) {
      const auto watcher = queue_.Subscribe(job_id, [bell = bell_] {
        const std::lock_guard ring(bell->mutex);
        if (bell->reactor != nullptr) bell->reactor->WriteNews();
      });
      status = watcher.status();
      if (watcher.ok()) watcher_ = *watcher;
    }
    if (!status.ok()) return End(ToGrpcStatus(status));
    bell_->reactor = this;
    WriteNews();
  }

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(bell_->mutex);
    writing_ = false;
    stalls_.Rest();
    if (finished_) return;
    if (!ok || cancelled_) return End(stalls_.StatusOfFailure());
    if (last_written_) return End(grpc::Status::OK);
    WriteNews();
  }

  void OnCancel() override {
    const std::lock_guard lock(bell_->mutex);
    cancelled_ = true;
    if (!writing_) End(grpc::Status::CANCELLED);  // otherwise the end of the write ends it
  }

  void OnDone() override {
    {
      const std::lock_guard lock(bell_->mutex);
      bell_->reactor = nullptr;
    }
    if (watcher_ != 0) queue_.Unsubscribe(watcher_);
    delete this;
  }

 private:
  // The functions below need the lock.
  void WriteNews() {
    if (writing_ || finished_) return;
    JobQueue::News news = queue_.PollUpdates(watcher_);
    if (news.stopping) {
      return End({grpc::StatusCode::UNAVAILABLE, "the daemon is shutting down"});
    }
    if (!news.update) return;
    update_ = *std::move(news.update);
    last_written_ = news.ended;
    writing_ = true;
    stalls_.Moved();
    StartWrite(&update_);
  }

  void End(const grpc::Status& status) {
    if (std::exchange(finished_, true)) return;
    Finish(status);
  }

  JobQueue& queue_;
  StallWatch stalls_;
  const std::shared_ptr<Bell> bell_ = std::make_shared<Bell>();
  int64_t watcher_ = 0;
  v1::JobUpdate update_;
  bool writing_ = false;
  bool last_written_ = false;
  bool cancelled_ = false;
  bool finished_ = false;
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
