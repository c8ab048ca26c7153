// What JobQueue keeps of a job, a task and a watcher. Only for its own source files.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "services/daemon/job_queue.h"
#include "services/pipeline/result_lock.h"

namespace weft {

struct JobQueue::LiveJob {
  v1::Job job;  // its counts and remaining time are set by Describe
  JobFrames frames;
  // Set when the job is to end before all frames are dealt with.
  struct EarlyEnd {
    v1::JobState state;
    std::string message;
  };
  std::optional<EarlyEnd> early;
  bool checking = false;           // its results are being looked at; no task of it runs
  bool checked = false;            // they are all there
  bool finishing = false;          // its last files are being written
  bool unsaved = false;            // the catalogue refused a state of it; it gets them all once it can
  std::optional<v1::Job> outcome;  // its last state, until the catalogue has it
  // Set while a disk has no room for its tasks.
  std::optional<std::chrono::steady_clock::time_point> start_again;
  std::chrono::seconds pause{1};
  bool ended = false;
  int failed_starts = 0;  // workers in a row that ended before they began a frame
  int watchers = 0;
  int repairs = 0;                 // how often frames had to be done again
  std::optional<ResultLock> lock;  // from its first task to its end
  uint64_t version = 1;            // counts changes of `job`
  std::optional<std::chrono::steady_clock::time_point> first_task;
};

struct JobQueue::RunningTask {
  std::shared_ptr<LiveJob> job;
  std::vector<size_t> positions;
  std::optional<v1::TaskError> error;
  bool began = false;
};

struct JobQueue::Watcher {
  std::shared_ptr<LiveJob> job;
  std::function<void()> changed;
  uint64_t seen_job = 0;
  uint64_t seen_frames = 0;
  bool told_end = false;
};

inline int64_t UnixNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace weft
