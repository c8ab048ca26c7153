// Tasks as weft-worker processes on this machine.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/work/executor/child_process.h"
#include "services/work/executor/executor.h"

namespace weft {

struct LocalExecutorOptions {
  std::string worker_program;  // called as `PROGRAM TASK_FILE --parent PID`
  std::string task_folder;     // holds the files of running tasks; made where it is missing
  int workers = 1;
  int64_t worker_memory_mib = 0;  // that a worker may take; 0: any
  std::string worker_user;        // whom workers run as; empty: as this process
  // Of every task, see task.proto.
  std::vector<std::string> allowed_paths;
  std::string state_folder;
  std::string process_folder;  // of records of the workers that run (process_record.h)
  // Between SIGTERM and SIGKILL.
  std::chrono::milliseconds stop_grace{5000};
  // A worker that reports nothing for this long hangs, and is killed.
  std::chrono::milliseconds silence_limit{std::chrono::minutes(15)};

  // InvalidArgument names the field.
  absl::Status Validate() const;
};

// One thread starts the workers, reads what they print, and reaps them. Workers end with the executor, also
// when its process is killed.
class LocalExecutor : public Executor {
 public:
  // InvalidArgument: options. NotFound, PermissionDenied: the program, or the task folder.
  static absl::StatusOr<std::unique_ptr<LocalExecutor>> Create(LocalExecutorOptions options);
  ~LocalExecutor() override;

  int slots() const override { return options_.workers; }
  absl::Status Start(const v1::Task& task, TaskListener listener) override;
  void Stop(const std::string& task_id) override;
  void StopAll() override;

 private:
  struct Run;
  using Clock = std::chrono::steady_clock;

  explicit LocalExecutor(LocalExecutorOptions options);
  void Wake() const;
  void Loop();
  // The functions below run in the loop's thread.
  bool TakeRequests();
  void Launch(Run& run);
  void BeginStop(Run& run, const std::string& why);
  void EnforceDeadlines();
  void WaitForEvents();
  void Listen(Run& run);
  void OnOutput(Run& run, const std::string& line);
  void Finish(Run& run);
  void RemoveFinished();

  const LocalExecutorOptions options_;
  UniqueFd wake_;

  Mutex mutex_;
  std::vector<std::unique_ptr<Run>> starts_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> stops_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> taken_ ABSL_GUARDED_BY(mutex_);  // ids that hold a slot
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;

  std::map<std::string, std::unique_ptr<Run>> runs_;  // of the loop's thread
  Mutex join_mutex_;
  std::thread thread_ ABSL_GUARDED_BY(join_mutex_);
};

}  // namespace weft
