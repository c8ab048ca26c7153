// Ctrl-C and SIGTERM as a request to stop.
#pragma once

#include <functional>
#include <stop_token>
#include <thread>

namespace weft {

// While one lives, the first SIGINT or SIGTERM requests a stop; the second one ends the process at once, as
// if nobody had caught it. Construct it before any other thread starts, since it blocks the signals for the
// calling thread and those that it will start.
class StopOnSignal {
 public:
  // `on_hangup`: called in a thread of its own for SIGHUP, which is otherwise left alone.
  explicit StopOnSignal(std::function<void()> on_hangup = {});
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  std::stop_token token() const { return source_.get_token(); }

 private:
  void Watch(const std::stop_token& finished);

  const std::function<void()> on_hangup_;
  std::stop_source source_;
  std::jthread watcher_;
};

}  // namespace weft
