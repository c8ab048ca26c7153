#include "services/ground/process/stop_on_signal.h"

#include <csignal>
#include <utility>

namespace weft {
namespace {

sigset_t CaughtSignals(bool hangup) {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  if (hangup) sigaddset(&set, SIGHUP);
  return set;
}

}  // namespace

void StopOnSignal::Watch(const std::stop_token& finished) {
  const sigset_t signals = CaughtSignals(on_hangup_ != nullptr);
  while (true) {
    int signal = 0;
    sigwait(&signals, &signal);
    if (finished.stop_requested()) return;
    if (signal == SIGHUP) {
      on_hangup_();
      continue;
    }
    if (source_.stop_requested()) {
      std::signal(signal, SIG_DFL);
      pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
      raise(signal);
    }
    source_.request_stop();
  }
}

StopOnSignal::StopOnSignal(std::function<void()> on_hangup) : on_hangup_(std::move(on_hangup)) {
  const sigset_t signals = CaughtSignals(on_hangup_ != nullptr);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  watcher_ = std::jthread([this](const std::stop_token& finished) { Watch(finished); });
}

StopOnSignal::~StopOnSignal() {
  watcher_.request_stop();
  // To this thread alone, which blocks it and wakes up: commands end at once.
  pthread_kill(watcher_.native_handle(), SIGTERM);
  watcher_.join();
  const sigset_t signals = CaughtSignals(on_hangup_ != nullptr);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

}  // namespace weft
