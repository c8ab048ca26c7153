// Ctrl-C and SIGTERM as a request to stop.
#pragma once

#include <stop_token>
#include <thread>

namespace weft {

// While one lives, the first SIGINT or SIGTERM requests a stop; the second one ends the process at once, as
// if nobody had caught it. Construct it before any other thread starts, since it blocks both signals for the
// calling thread and those that it will start.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::jthread watcher_;
};

}  // namespace weft
