// What SlurmExecutor keeps of a task and of an array. Only for its own source files.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "services/work/slurm/slurm_executor.h"

namespace weft {

struct SlurmExecutor::Array {
  explicit Array(TaskFolder its_folder) : folder(std::move(its_folder)) {}

  TaskFolder folder;
  int64_t id = 0;
  int64_t memory_mib = 0;
  int throttle = 0;    // elements that may run at once
  int unfinished = 0;  // elements
};

struct SlurmExecutor::Run {
  v1::Task task;
  TaskListener listener;
  std::shared_ptr<Array> array;  // null: Slurm does not have it
  int index = 0;                 // in its array
  std::optional<EventReader> events;
  Clock::time_point heard;  // when it said something last, or was submitted
  int64_t submitted_unix_ns = 0;
  double queued_s = 0;
  std::string host;
  std::set<std::string> finished;  // frames
  std::optional<v1::WorkerEnded> ended;
  std::optional<v1::TaskError> error;
  std::optional<SlurmRecord> record;         // Slurm's last word
  std::optional<Clock::time_point> gone_at;  // since when Slurm says that it does not run
  std::optional<Clock::time_point> cancelled_at;
  bool was_stopped = false;
  bool over = false;
};

}  // namespace weft
