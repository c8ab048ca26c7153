// How a task on a cluster ended, and why one waits, in the words of its job.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/work/executor/executor.h"
#include "services/work/slurm/slurm_state.h"
#include "weft/v1/task.pb.h"

namespace weft {

// What is known of a task that does not run any more, or says so.
struct TaskFacts {
  bool was_stopped = false;  // by us
  std::optional<v1::WorkerEnded> ended;
  std::optional<v1::TaskError> error;
  int frames_finished = 0;
  std::optional<SlurmRecord> record;  // Slurm's last word
  std::string host;                   // where it began; empty: it did not
  std::string last_words;             // of its log
  std::string log_file;
  std::string full_folder;  // why its folder takes no file; empty: it does
  int time_limit_min = 0;
  int64_t memory_mib = 0;
  double lag_s = 0;
};

struct TaskVerdict {
  TaskEnd end;
  // What ends the job, where repeating the task would not help.
  std::optional<v1::TaskError> error;
};

// Whether the worker's own words suffice: it ended by itself, and not because somebody else stopped it.
bool EndedByItself(const TaskFacts& facts);

// Lost are tasks whose node failed, that were preempted or cancelled by others, that reached their time limit
// after at least one frame, or whose end nobody knows. A task that reached it before its first frame is an
// error of the job. All other ends are those of a worker on this machine.
TaskVerdict JudgeTask(const TaskFacts& facts);

// Why Slurm does not start a task, with a remedy; empty: it waits for its turn.
std::string WhyWaiting(const SlurmRecord& record, const std::string& partition, int time_limit_min);

}  // namespace weft
