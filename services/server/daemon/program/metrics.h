// What a daemon counts, for Prometheus.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "services/server/daemon/door/observed_call.h"

namespace weft {

// How things stand when Prometheus asks.
struct DaemonLoad {
  int jobs_queued = 0, jobs_running = 0, watchers = 0;
  int64_t frames_done = 0, frames_failed = 0;  // since the daemon began
  int takes_recording = 0;
  uint64_t sets_dropped = 0, frames_missing = 0;  // of takes that are recorded now
  int connections = 0;
  int calls_running = 0, streams_running = 0, uploads_running = 0;
  int workers = 0;
  uint64_t state_free_bytes = 0;
  bool serving = true;
};

// Names, units and help stand in metrics.cpp; each begins with "weft_" or "process_". Thread safety: any
// thread.
class Metrics {
 public:
  // `load` is asked for every text. `started_s`: since 1970.
  explicit Metrics(std::function<DaemonLoad()> load, double started_s);
  ~Metrics();

  void Count(const ObservedCall& call);

  // The text format of Prometheus, version 0.0.4.
  std::string Text();
  static constexpr char kType[] = "text/plain; version=0.0.4; charset=utf-8";

 private:
  struct Families;
  const std::function<DaemonLoad()> load_;
  const std::unique_ptr<Families> families_;
};

}  // namespace weft
