// Server streams of something that is looked at now and then.
#pragma once

#include <grpcpp/alarm.h>
#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <functional>
#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/server/daemon/calls/stall_watch.h"
#include "services/server/rpc/grpc_status.h"

namespace weft {

// Streams what `get` says until `has_ended`, looking four times a second, and between two writes: a slow
// client costs neither memory nor a thread. Deletes itself when the stream has ended, also when the client
// has gone or takes nothing for `patience`.
template <typename Message>
class PollingWatcher : public grpc::ServerWriteReactor<Message> {
 public:
  PollingWatcher(grpc::CallbackServerContext* context, std::function<absl::StatusOr<Message>()> get,
                 std::function<bool(const Message&)> has_ended,
                 std::chrono::milliseconds patience = StallWatch::kReadTimeout)
      : get_(std::move(get)), has_ended_(std::move(has_ended)), stalls_(context, patience) {
    stalls_.Rest();
  }

  void Look() {
    // Called by the alarm, too, of which gRPC does not know when it deletes this: the lock must outlive it.
    const std::shared_ptr<Mutex> outlives = mutex_;
    const MutexLock lock(*mutex_);
    waiting_ = false;
    if (cancelled_) return End(grpc::Status::CANCELLED);
    absl::StatusOr<Message> now = get_();
    if (!now.ok()) return End(ToGrpcStatus(now.status()));
    if (now->SerializeAsString() == written_.SerializeAsString()) return Wait();
    written_ = *std::move(now);
    writing_ = true;
    stalls_.Moved();
    this->StartWrite(&written_);
  }

  void OnWriteDone(bool ok) override {
    const MutexLock lock(*mutex_);
    writing_ = false;
    stalls_.Rest();
    if (!ok || cancelled_) return End(stalls_.StatusOfFailure());
    if (has_ended_(written_)) return End(grpc::Status::OK);
    Wait();
  }

  void OnCancel() override {
    const MutexLock lock(*mutex_);
    cancelled_ = true;
    if (waiting_) alarm_->Cancel();
  }

  void OnDone() override {
    // Whoever ended the stream lets go of the lock first.
    { const MutexLock lock(*mutex_); }
    delete this;
  }

 private:
  void Wait() ABSL_EXCLUSIVE_LOCKS_REQUIRED(*mutex_) {
    constexpr std::chrono::milliseconds kPeriod{250};
    waiting_ = true;
    // Another one each time: this may be the call of the last one.
    alarm_ = std::make_unique<grpc::Alarm>();
    alarm_->Set(std::chrono::system_clock::now() + kPeriod, [this](bool) { Look(); });
  }

  void End(const grpc::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(*mutex_) {
    if (!std::exchange(finished_, true)) this->Finish(status);
  }

  const std::function<absl::StatusOr<Message>()> get_;
  const std::function<bool(const Message&)> has_ended_;
  StallWatch stalls_;
  const std::shared_ptr<Mutex> mutex_ = std::make_shared<Mutex>();
  std::unique_ptr<grpc::Alarm> alarm_ ABSL_GUARDED_BY(*mutex_);
  Message written_ ABSL_GUARDED_BY(*mutex_);
  bool writing_ ABSL_GUARDED_BY(*mutex_) = false;
  bool waiting_ ABSL_GUARDED_BY(*mutex_) = false;
  bool cancelled_ ABSL_GUARDED_BY(*mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(*mutex_) = false;
};

}  // namespace weft
