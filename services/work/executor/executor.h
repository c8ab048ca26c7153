// Where tasks run: worker processes on this machine (local_executor.h), or on many (services/work/slurm).
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "weft/v1/task.pb.h"

namespace weft {

// How a task's process ended.
struct TaskEnd {
  bool clean = false;  // by itself with exit status 0
  // For people when not clean, e.g. "killed by signal 11 (Segmentation fault); its last output: ...".
  std::string reason;
  // It was never started, since this machine had no room for it (disk, processes); the task is not to blame.
  bool refused = false;
  // Its machine failed, or a scheduler took the machine away; the task is not to blame.
  bool lost = false;
  double queued_s = 0;  // from its submission to a scheduler to its start
};

// How tasks should be cut.
struct TaskShape {
  int parallel = 1;      // tasks that run at once
  int least_frames = 1;  // of a task, where so many wait
  int most_frames = 16;
  bool is_queued = false;  // a task may wait long before it begins
};

// Called one at a time from a thread of the executor, never from within a call of Executor. `ended` comes
// last. Neither may call StopAll.
struct TaskListener {
  std::function<void(const v1::WorkerEvent& event)> event;
  std::function<void(const TaskEnd& end)> ended;
  // Why the task does not begin, in words for people; and what else they should know of it.
  std::function<void(const std::string& why)> waits = [](const std::string&) {};
  std::function<void(const std::string& note)> noted = [](const std::string&) {};
};

// Thread safety: any thread may call any function.
class Executor {
 public:
  virtual ~Executor() = default;

  // Tasks that it takes at once.
  virtual int slots() const = 0;
  virtual TaskShape shape() const { return {.parallel = slots()}; }
  // Folder of the logs of a job's tasks; empty: there are none.
  virtual std::string LogFolder(const std::string& /*job_id*/) const { return ""; }
  // Offers the tasks that run on from before this executor was made, because its forerunner was killed; those
  // without a listener are stopped. Call it before the first Start. `claim` is called in this call.
  using Claim = std::function<std::optional<TaskListener>(const v1::Task& task)>;
  virtual void TakeUp(const Claim& /*claim*/) {}
  // ResourceExhausted: every slot is taken. AlreadyExists: a running task of this id. Unavailable: StopAll
  // was called. A task that cannot be started is reported by `ended`.
  virtual absl::Status Start(const v1::Task& task, TaskListener listener) = 0;
  // Asks the task to stop; if it does not within the grace time, it is killed. `ended` tells. No such task:
  // no effect.
  virtual void Stop(const std::string& task_id) = 0;
  // Stops every task, and returns after the last `ended`; no task can be started any more.
  virtual void StopAll() = 0;
};

}  // namespace weft
