// The daemon's jobs: a table of them, run by an executor, written down by a store.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "capture/take/take_progress.h"
#include "services/server/access/call_limits.h"
#include "services/server/callers/turns.h"
#include "services/server/catalogue/catalogue.h"
#include "services/server/daemon/work/job_store.h"
#include "services/server/daemon/work/job_table.h"
#include "services/server/daemon/work/job_watchers.h"
#include "services/server/daemon/work/published_jobs.h"
#include "services/server/retention/retention_plan.h"
#include "services/work/executor/executor.h"
#include "services/work/job/job_folder.h"

namespace weft {

struct JobQueueOptions {
  int threads_per_worker = 1;
  // Of Warnings, for as long as the daemon runs.
  std::vector<std::string> warnings;
  // Asked before a job is done, and when one is taken up again; what it names is registered again.
  FindIncomplete find_incomplete;
  // False while the take in this folder waits for its recovery; jobs that follow it wait, too.
  std::function<bool(const std::string& dump)> is_settled = [](const std::string&) { return true; };
  JobEndings endings;
  int max_of_one_caller = CallerLimits().jobs;  // unfinished
  // Asked before new work is taken; its errors refuse it.
  std::function<absl::Status()> admit = [] { return absl::OkStatus(); };
  // Where the results of jobs lie that named no folder: <results_folder>/<job id>.
  std::string results_folder;
  // Whether an unfinished job or operation reads this folder. Called without the lock.
  std::function<bool(const std::string& folder)> is_read = [](const std::string&) { return false; };
  // Called in the background before a job's end is written down, so that it is called for every end; again
  // where the daemon is killed in between. ResourceExhausted makes the job wait.
  std::function<absl::Status(const v1::Job& job)> on_end = [](const v1::Job&) { return absl::OkStatus(); };
};

// Schedules what JobTable decides: it starts tasks, reads and writes folders in the background, has states
// written down (JobStore) and those who watch notified (JobWatchers). Once it is made, no file is read or
// written under its lock. Thread safety: any thread may call any function.
class JobQueue {
 public:
  // Takes up the catalogue's unfinished jobs where they stopped. Errors of the catalogue.
  static absl::StatusOr<std::unique_ptr<JobQueue>> Create(std::unique_ptr<Catalogue> catalogue,
                                                          std::unique_ptr<Executor> executor,
                                                          JobQueueOptions options);
  ~JobQueue();

  // Queues a job whose id, spec and inputs are set. AlreadyExists: a job of this id. Errors of
  // JobTable::Reserve, by the role of who submitted it. Unavailable: the daemon is draining.
  absl::Status Submit(v1::Job job, const std::vector<std::string>& frames, v1::Role role);

  // NotFound: no such job.
  absl::StatusOr<v1::Job> Get(const std::string& job_id);
  absl::StatusOr<std::vector<v1::FrameInfo>> Frames(const std::string& job_id);
  // Returns when its workers have ended. A job that has ended stays as it is.
  absl::StatusOr<v1::Job> Cancel(const std::string& job_id);
  // Queues an ended job once more, for its failed and cancelled frames. One without such frames, or one that
  // has not ended, stays as it is. Errors of Submit.
  absl::StatusOr<v1::Job> Retry(const std::string& job_id, v1::Role role);
  // The job's place in the queue from now on. One that has ended stays as it is.
  absl::StatusOr<v1::Job> SetPriority(const std::string& job_id, int priority);
  // Newest first; those before the job `older_than`, if it is not empty. NotFound: it is not there any more.
  absl::StatusOr<std::vector<v1::Job>> List(int limit, const std::string& older_than = "");
  // Those that have not ended, in no order.
  std::vector<v1::Job> Unfinished();
  // The newest unfinished one that follows the take in this folder.
  std::optional<v1::Job> FollowerOf(const std::string& take_folder);
  struct Load {
    int queued = 0;
    int running = 0;
    int watchers = 0;
    int64_t frames_done = 0, frames_failed = 0;  // since the queue was made
    std::string trouble;                         // why states cannot be written down; empty: they can
  };
  Load CurrentLoad();
  // What a user must know of the daemon's state now: a catalogue that was restored, a disk without room.
  std::vector<std::string> Warnings();

  // One who watches a job. `changed` is called from any thread, without a lock, after every change; a call
  // may still come while Unsubscribe runs. NotFound: no such job. ResourceExhausted: too many watchers.
  absl::StatusOr<int64_t> Subscribe(const std::string& job_id, std::function<void()> changed);
  void Unsubscribe(int64_t watcher);
  struct Updates : JobWatchers::Updates {
    bool stopping = false;  // the daemon shuts down
  };
  Updates PollUpdates(int64_t watcher);

  // The ended jobs. Finishes what a daemon that was killed was at.
  std::vector<Holding> EndedHoldings();
  // Whether somebody watches it, or reads its results.
  bool IsInUse(const std::string& job_id);
  // Forgets one that ended at this time, with its results below results_folder. FailedPrecondition: it is in
  // use, or was retried meanwhile.
  absl::Status ForgetEnded(const std::string& job_id, int64_t finished_unix_ns);

  using DrainState = JobTable::DrainState;
  // Takes no new jobs, and has workers stop after the frame that they are at. `finish_jobs`: jobs go on until
  // all have ended. The last call counts.
  DrainState Drain(bool finish_jobs);
  DrainState CurrentDrain();

  // Stops the workers, keeps all states for the next start. No job can be submitted any more.
  void Stop();

 private:
  using Lock = MutexLock<Mutex>;
  using FilesWork = JobEffects::Files;
  // Folders take a moment and have a thread of their own; whole results may take minutes.
  enum class Lane { kFolders, kResults };
  // For one job one after the other.
  struct Deferred {
    JobRef job;
    Lane lane;
    std::function<void()> work;
  };
  // Of the background, one work of a job at a time.
  struct JobFiles {
    explicit JobFiles(const v1::Job& job);
    JobFolder folder;                    // its lock is held from the job's first task to its end
    std::unique_ptr<TakeFollower> take;  // as long as the job follows it
  };

  JobQueue(std::unique_ptr<Catalogue> catalogue, std::unique_ptr<Executor> executor, JobQueueOptions options);
  absl::Status Resume();
  std::optional<TaskListener> TakeUpTask(const v1::Task& task) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  TaskListener ListenerOf(const std::string& task_id);

  // When those who watch are told of a state: so that a daemon that is killed remembers what it told, or, by
  // the store's own thread, without waiting for itself. What a disk refuses is told all the same.
  enum class Telling { kWhenWritten, kAtOnce };
  // Does what follows from the table's changes, and lets go of the lock.
  void Settle(Lock& lock, Telling telling = Telling::kWhenWritten)
      ABSL_UNLOCK_FUNCTION(mutex_) ABSL_NO_THREAD_SAFETY_ANALYSIS;
  void StartTasks() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool DoEffects() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Publish(const JobRef& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void DeferReport(const JobEffects::Quarantined& frame) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Defer(const JobRef& job, FilesWork what) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ForgetIfUnwatched(const JobRef& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::optional<Deferred> NextDeferred(Lane lane) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // The store's thread has written down, or could not write down, the end of a job.
  void OnSaved(const JobRef& job);
  void OnRefused(const JobRef& job, const std::string& why);

  // Of the background, without the lock (job_queue_files.cpp).
  void WorkInBackground(Lane lane);
  void TakeFolder(const JobRef& job, JobFiles& files);
  void CheckResults(const JobRef& job, JobFiles& files);
  void WriteResults(const JobRef& job, JobFiles& files);
  void PollTake(const JobRef& job, JobFiles& files);
  // Folders with what the daemon keeps of ended jobs (job_queue_retention.cpp).
  std::vector<std::string> OwnFolders() const;

  const std::unique_ptr<Executor> executor_;
  const JobQueueOptions options_;
  PublishedJobs published_;

  Mutex retrying_, forgetting_;  // in this order, and before mutex_
  Mutex mutex_;
  std::condition_variable_any job_ended_, deferred_changed_;
  JobTable table_ ABSL_GUARDED_BY(mutex_);
  JobWatchers watchers_ ABSL_GUARDED_BY(mutex_);
  std::map<JobRef, std::shared_ptr<JobFiles>> files_ ABSL_GUARDED_BY(mutex_);  // of unfinished jobs
  std::vector<std::function<void()>> to_call_ ABSL_GUARDED_BY(mutex_);         // those who watch
  std::set<std::string> to_flush_ ABSL_GUARDED_BY(mutex_);                     // jobs that were put
  std::list<Deferred> deferred_ ABSL_GUARDED_BY(mutex_);
  std::set<JobRef> in_background_ ABSL_GUARDED_BY(mutex_);
  Turns background_turns_ ABSL_GUARDED_BY(mutex_);
  bool background_ends_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_stopped_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> background_;
  std::unique_ptr<JobStore> store_;  // calls OnSaved, so it goes first
};

}  // namespace weft
