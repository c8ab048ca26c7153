#include "services/server/daemon/calls/stall_watch.h"

#include <atomic>

#include "absl/strings/str_cat.h"
#include "base/mutex.h"

namespace weft {

// Outlives the watch where the alarm rings meanwhile.
struct StallWatch::State {
  // For the alarm.
  static void Wait(const std::shared_ptr<State>& state) ABSL_EXCLUSIVE_LOCKS_REQUIRED(state->mutex);

  // Cancelling a call may end it at once, in this thread.
  RecursiveMutex mutex;
  grpc::ServerContextBase* context ABSL_GUARDED_BY(mutex) = nullptr;  // null: the watch has ended
  std::chrono::milliseconds patience{};
  std::atomic<bool> moved = false, resting = false, stalled = false;
  std::unique_ptr<grpc::Alarm> alarm ABSL_GUARDED_BY(mutex);
};

StallWatch::StallWatch(grpc::ServerContextBase* context, std::chrono::milliseconds patience)
    : state_(std::make_shared<State>()) {
  state_->patience = patience;
  const MutexLock lock(state_->mutex);
  state_->context = context;
  State::Wait(state_);
}

StallWatch::~StallWatch() {
  const MutexLock lock(state_->mutex);
  state_->context = nullptr;
  state_->alarm.reset();  // it holds the state
}

void StallWatch::Moved() {
  state_->moved = true;
  state_->resting = false;
}

void StallWatch::Rest() { state_->resting = true; }

grpc::Status StallWatch::StatusOfFailure() const {
  if (!state_->stalled) return grpc::Status::CANCELLED;
  return {grpc::StatusCode::DEADLINE_EXCEEDED,
          absl::StrCat("the client took and sent nothing for ",
                       std::chrono::ceil<std::chrono::seconds>(state_->patience).count(), " s")};
}

void StallWatch::State::Wait(const std::shared_ptr<State>& state) {
  // Another one each time: this may be the call of the last one.
  state->alarm = std::make_unique<grpc::Alarm>();
  state->alarm->Set(std::chrono::system_clock::now() + state->patience, [state](bool rang) {
    const MutexLock lock(state->mutex);
    if (!rang || state->context == nullptr) return;
    if (state->resting || state->moved.exchange(false)) return Wait(state);
    state->stalled = true;
    state->context->TryCancel();
  });
}

}  // namespace weft
