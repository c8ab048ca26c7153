#include "services/daemon/stall_watch.h"

namespace weft {

// Outlives the watch where the alarm rings meanwhile.
struct StallWatch::State {
  // Cancelling a call may end it at once, in this thread.
  std::recursive_mutex mutex;
  grpc::ServerContextBase* context = nullptr;  // null: the watch has ended
  std::chrono::milliseconds patience{};
  bool moved = false;
  std::unique_ptr<grpc::Alarm> alarm;
};

StallWatch::StallWatch(grpc::ServerContextBase* context, std::chrono::milliseconds patience)
    : state_(std::make_shared<State>()) {
  state_->context = context;
  state_->patience = patience;
  const std::lock_guard lock(state_->mutex);
  Wait(state_);
}

StallWatch::~StallWatch() {
  const std::lock_guard lock(state_->mutex);
  state_->context = nullptr;
  state_->alarm.reset();  // it holds the state
}

void StallWatch::Moved() {
  const std::lock_guard lock(state_->mutex);
  state_->moved = true;
}

void StallWatch::Wait(const std::shared_ptr<State>& state) {
  // Another one each time: this may be the call of the last one.
  state->alarm = std::make_unique<grpc::Alarm>();
  state->alarm->Set(std::chrono::system_clock::now() + state->patience, [state](bool rang) {
    const std::lock_guard lock(state->mutex);
    if (!rang || state->context == nullptr) return;
    if (!std::exchange(state->moved, false)) return state->context->TryCancel();
    Wait(state);
  });
}

}  // namespace weft
