// Tasks as elements of job arrays of Slurm.
#pragma once

#include <chrono>
#include <condition_variable>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/work/executor/executor.h"
#include "services/work/slurm/slurm_commands.h"
#include "services/work/slurm/slurm_options.h"
#include "services/work/slurm/task_end.h"
#include "services/work/slurm/task_folder.h"

namespace weft {

// One thread submits tasks, those of a job that come at once as one array, or as several where the cluster
// limits arrays or jobs. It reads the files in which workers write what they do. Slurm is asked only for
// tasks that say nothing, with one query for all of them and not more often than SlurmOptions.query_s. No
// element runs twice: tasks that are lost end, and whoever started them starts new ones. Where Slurm does not
// answer, tasks wait and say so. Tasks of an executor that was killed are offered by the next one on the same
// folder (TakeUp), and cancelled where nobody wants them.
class SlurmExecutor : public Executor {
 public:
  // InvalidArgument: options. NotFound: a command of Slurm. Otherwise errors of CreateFolders. A cluster that
  // does not answer is no error.
  static absl::StatusOr<std::unique_ptr<SlurmExecutor>> Create(SlurmOptions options);
  ~SlurmExecutor() override;

  int slots() const override;
  TaskShape shape() const override;
  std::string LogFolder(const std::string& job_id) const override;
  // Nothing is submitted or cancelled before TakeUp or Start is called.
  void TakeUp(const Claim& claim) override;
  absl::Status Start(const v1::Task& task, TaskListener listener) override;
  // A task that Slurm has ends when Slurm or its worker has confirmed the end.
  void Stop(const std::string& task_id) override;
  // Leaves to the next executor what is not confirmed within SlurmOptions.stop_patience.
  void StopAll() override;

 private:
  struct Array;
  struct Run;
  using Clock = std::chrono::steady_clock;

  SlurmExecutor(SlurmOptions options, PathMap map, SlurmCommands commands, std::string tag);
  void TakeUpArray(const TaskFolder& folder, const v1::SubmittedArray& submitted, const Claim& claim);
  void Loop();
  // The functions below run in the loop's thread.
  bool TakeRequests();
  void Submit();
  void SubmitJob(const std::string& job_id, Clock::time_point now);
  void LearnLimits();
  void SubmitLater(size_t elements, const absl::Status& status, Clock::time_point now);
  std::vector<std::string> SubmitArguments(const Array& array, const v1::Task& first) const;
  void RefuseAll(const std::vector<Run*>& runs, const absl::Status& status);
  int Room() const;
  void RaiseThrottles();
  void ReadEvents();
  void OnEvent(Run& run, const v1::WorkerEvent& event);
  void CancelStopped();
  void QueryIfSilent();
  void UseRecords(const std::vector<SlurmRecord>& records);
  bool IsWhole(const std::vector<SlurmRecord>& records) const;
  void CancelLeftovers(const std::vector<SlurmRecord>& records);
  void Conclude();
  bool IsOver(const Run& run, Clock::time_point now) const;
  TaskFacts FactsOf(const Run& run) const;
  void End(Run& run, const TaskVerdict& verdict);
  void RemoveEnded();
  void ReportWaiting(const std::string& why);
  int64_t MemoryFor(const std::string& job_id) const;

  const SlurmOptions options_;
  const PathMap map_;
  const SlurmCommands commands_;
  const std::string tag_;  // in the comment of our jobs

  Mutex mutex_;
  std::condition_variable_any woken_;
  std::vector<std::unique_ptr<Run>> starts_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> stops_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::shared_ptr<Array>> taken_up_ ABSL_GUARDED_BY(mutex_);
  // Elements of those that nobody wants, as scancel names them.
  std::vector<std::string> unclaimed_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> taken_ ABSL_GUARDED_BY(mutex_);  // ids that hold a slot
  bool has_requests_ ABSL_GUARDED_BY(mutex_) = false;
  bool may_begin_ ABSL_GUARDED_BY(mutex_) = false;  // whoever owns this has claimed what he wants
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;

  // Of the loop's thread.
  std::list<std::unique_ptr<Run>> runs_;  // in the order of their starts
  std::list<std::shared_ptr<Array>> arrays_;
  std::map<std::string, double> peak_mib_;  // by job
  std::set<std::string> clock_noted_;       // hosts
  std::set<int64_t> own_arrays_;            // ids of all that this executor submitted
  bool begins_ = false;                     // may_begin_, as TakeRequests saw it
  bool knows_leftovers_ = false;            // those of an earlier executor are being cancelled
  std::optional<Clock::time_point> last_query_, submit_again_, stop_by_, next_look_, next_raise_;
  int next_array_ = 1;
  bool knows_limits_ = false;
  size_t array_limit_ = 1, most_at_once_ = 1;  // elements of an array: that may ever be, that are tried next
  Mutex join_mutex_;
  std::thread thread_ ABSL_GUARDED_BY(join_mutex_);
};

}  // namespace weft
