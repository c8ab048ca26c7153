// Server streams without a thread per client.
#pragma once

#include <grpcpp/alarm.h>
#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <functional>
#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/stall_watch.h"

namespace weft {

enum class StreamNews {
  kNone,     // nothing new
  kMessage,  // a message, and perhaps more
  kLast,     // a message, and the stream ends after it
  kOver,     // the stream ends
};

// Writes one message after the other, and asks for the next once the one before is on its way: a slow client
// costs neither a thread nor more than one message. Deletes itself when the stream has ended, also when the
// client has gone or takes nothing for `patience`.
template <typename Message>
class ServerStream : public grpc::ServerWriteReactor<Message> {
 public:
  // Fills in the next message, in place of the one before. Called by one thread at a time. Errors end the
  // stream.
  using Next = std::function<absl::StatusOr<StreamNews>(Message& message)>;

  // `method` is for the log. `period`: between two messages, and until the next look where there is nothing
  // new; 0: at once, and when the bell rings.
  ServerStream(grpc::CallbackServerContext* context, const char* method, std::chrono::milliseconds patience,
               std::chrono::milliseconds period = {})
      : method_(method), period_(period), stalls_(context, patience) {
    stalls_.Rest();
  }

  // Says that there is something new, from any thread, also before the stream begins and after it has ended.
  std::function<void()> bell() const {
    return [bell = bell_] { Ring(bell); };
  }

  // `next` is asked before this returns.
  void Begin(Next next) {
    const MutexLock lock(bell_->mutex);
    next_ = std::move(next);
    bell_->stream = this;
    WriteNext();
  }

  void OnWriteDone(bool ok) override {
    const MutexLock lock(bell_->mutex);
    is_writing_ = false;
    stalls_.Rest();
    if (!ok || is_cancelled_) return End(stalls_.StatusOfFailure());
    if (news_ == StreamNews::kLast) return End(grpc::Status::OK);
    if (period_.count() > 0) return PollLater();
    WriteNext();
  }

  void OnCancel() override {
    const MutexLock lock(bell_->mutex);
    is_cancelled_ = true;
    if (!is_writing_) End(grpc::Status::CANCELLED);  // otherwise the end of the write ends it
  }

  void OnDone() override {
    {
      const MutexLock lock(bell_->mutex);
      bell_->stream = nullptr;
    }
    delete this;
  }

 private:
  // Outlives the stream where it rings meanwhile.
  struct Bell {
    Mutex mutex;
    ServerStream* stream ABSL_GUARDED_BY(mutex) = nullptr;
  };

  static void Ring(const std::shared_ptr<Bell>& bell) {
    const MutexLock lock(bell->mutex);
    if (bell->stream != nullptr) bell->stream->Rung();
  }

  // By a bell that is held, which is this one's.
  void Rung() {
    bell_->mutex.AssertHeld();
    WriteNext();
  }

  void WriteNext() ABSL_EXCLUSIVE_LOCKS_REQUIRED(bell_->mutex) {
    if (is_writing_ || has_ended_) return;
    const grpc::Status status = Answer(method_, [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(bell_->mutex) {
      return Assign(next_(message_), &news_);
    });
    if (!status.ok() || news_ == StreamNews::kOver) return End(status);
    if (news_ == StreamNews::kNone) return PollLater();
    is_writing_ = true;
    stalls_.Moved();
    this->StartWrite(&message_);
  }

  void PollLater() ABSL_EXCLUSIVE_LOCKS_REQUIRED(bell_->mutex) {
    if (period_.count() == 0) return;
    // Another one each time: this may be the call of the last one.
    alarm_ = std::make_unique<grpc::Alarm>();
    alarm_->Set(std::chrono::system_clock::now() + period_, [bell = bell_](bool) { Ring(bell); });
  }

  void End(const grpc::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(bell_->mutex) {
    if (!std::exchange(has_ended_, true)) this->Finish(status);
  }

  const char* const method_;
  const std::chrono::milliseconds period_;
  StallWatch stalls_;
  const std::shared_ptr<Bell> bell_ = std::make_shared<Bell>();
  Next next_ ABSL_GUARDED_BY(bell_->mutex);
  std::unique_ptr<grpc::Alarm> alarm_ ABSL_GUARDED_BY(bell_->mutex);
  Message message_ ABSL_GUARDED_BY(bell_->mutex);
  StreamNews news_ ABSL_GUARDED_BY(bell_->mutex) = StreamNews::kNone;
  bool is_writing_ ABSL_GUARDED_BY(bell_->mutex) = false;
  bool is_cancelled_ ABSL_GUARDED_BY(bell_->mutex) = false;
  bool has_ended_ ABSL_GUARDED_BY(bell_->mutex) = false;
};

// Streams what `get` says until `has_ended`, looking four times a second.
template <typename Message>
grpc::ServerWriteReactor<Message>* WatchByLooking(
    grpc::CallbackServerContext* context, const char* method, std::function<absl::StatusOr<Message>()> get,
    std::function<bool(const Message&)> has_ended,
    std::chrono::milliseconds patience = StallWatch::kReadTimeout) {
  constexpr std::chrono::milliseconds kPeriod{250};
  auto* stream = new ServerStream<Message>(context, method, patience, kPeriod);
  stream->Begin([get = std::move(get),
                 has_ended = std::move(has_ended)](Message& message) -> absl::StatusOr<StreamNews> {
    WEFT_ASSIGN_OR_RETURN(Message now, get());
    if (now.SerializeAsString() == message.SerializeAsString()) return StreamNews::kNone;
    message = std::move(now);
    return has_ended(message) ? StreamNews::kLast : StreamNews::kMessage;
  });
  return stream;
}

}  // namespace weft
