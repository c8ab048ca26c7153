// The daemon's jobs: cut into tasks, run by an executor, remembered in a catalogue.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/take/take_progress.h"
#include "services/server/access/call_limits.h"
#include "services/server/callers/turns.h"
#include "services/server/catalogue/catalogue.h"
#include "services/server/daemon/work/published_jobs.h"
#include "services/server/retention/retention_plan.h"
#include "services/work/executor/executor.h"
#include "services/work/job/job_folder.h"
#include "services/work/job/job_frames.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

struct JobQueueOptions {
  int threads_per_worker = 1;
  // Names of the frames of a job, from its inputs, for a job whose list of frames was damaged.
  std::function<absl::StatusOr<std::vector<std::string>>(const v1::RegistrationSpec& spec)> list_frames;
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

// Of the jobs of the highest class of priorities (owners.h), callers take turns (turns.h), each with its job
// of the highest priority, and of those the oldest. Tasks that run are not interrupted. A frame whose worker
// ends abnormally is tried again, kMaxAttempts times in all. The daemon's own end and full disks count
// against no frame and no job: failed operations are repeated until they succeed. Thread safety: any thread
// may call any function.
class JobQueue {
 public:
  // Takes up the catalogue's unfinished jobs where they stopped. Errors of the catalogue.
  static absl::StatusOr<std::unique_ptr<JobQueue>> Create(std::unique_ptr<Catalogue> catalogue,
                                                          std::unique_ptr<Executor> executor,
                                                          JobQueueOptions options);
  ~JobQueue();

  // Queues a job whose id, spec and inputs are set. AlreadyExists: a job of this id. FailedPrecondition:
  // another unfinished job writes to the same folder. ResourceExhausted: too many jobs wait, by the share of
  // who submitted it, who has this role. Unavailable: the daemon is shutting down, or draining.
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
  struct News {
    std::optional<v1::JobUpdate> update;  // none: nothing new since the last call
    bool ended = false;                   // the update is the last one
    bool stopping = false;                // the daemon shuts down
  };
  News PollUpdates(int64_t watcher);

  // The ended jobs. Finishes what a daemon that was killed was at.
  std::vector<Holding> EndedHoldings();
  // Whether somebody watches it, or reads its results.
  bool IsInUse(const std::string& job_id);
  // Forgets one that ended at this time, with its results below results_folder. FailedPrecondition: it is in
  // use, or was retried meanwhile.
  absl::Status ForgetEnded(const std::string& job_id, int64_t finished_unix_ns);

  struct DrainState {
    int tasks = 0;   // that workers have
    int frames = 0;  // that workers are at
    int jobs = 0;    // that have not ended
    bool is_drained = false;
  };
  // Takes no new jobs, and has workers stop after the frame that they are at. `finish_jobs`: jobs go on until
  // all have ended. The last call counts.
  DrainState Drain(bool finish_jobs);
  DrainState CurrentDrain();

  // Stops the workers, keeps all states for the next start. No job can be submitted any more.
  void Stop();

 private:
  struct LiveJob;
  struct RunningTask;
  struct Watcher;
  using Lock = std::unique_lock<std::mutex>;
  using Time = std::chrono::steady_clock::time_point;
  // Files to read or write, by the threads of background_: for one job one after the other.
  struct Deferred {
    std::shared_ptr<LiveJob> job;
    std::function<void()> work;
  };

  JobQueue(std::unique_ptr<Catalogue> catalogue, std::unique_ptr<Executor> executor, JobQueueOptions options);
  absl::Status Resume();
  void ResumeJob(v1::Job job, std::vector<v1::FrameInfo> infos);

  // The functions below take the lock, and tell the watchers when they have let go of it.
  void OnEvent(const std::string& task_id, const v1::WorkerEvent& event);
  void OnTaskEnded(const std::string& task_id, const TaskEnd& end);
  void OnTaskWaits(const std::string& task_id, const std::string& why);
  void OnTaskNoted(const std::string& task_id, const std::string& note);
  void LookAtTake(const std::shared_ptr<LiveJob>& job);
  void CheckResults(const std::shared_ptr<LiveJob>& job);
  void WriteResults(const std::shared_ptr<LiveJob>& job);
  void UnlockAndTell(Lock& lock);
  void WorkInBackground(bool is_first);  // the loop of each of background_

  // The functions below need the lock.
  absl::Status CheckRoom(const v1::Job& job, v1::Role role) const;  // errors of Submit
  void Enqueue(const std::shared_ptr<LiveJob>& job);
  std::shared_ptr<LiveJob> FindLive(const std::string& job_id) const;
  // Tasks (job_queue_tasks.cpp).
  void Schedule();
  bool MayBeginTask(const LiveJob& job) const;
  std::shared_ptr<LiveJob> NextJob(const std::set<std::string>& passed_over);
  bool StartTask(const std::shared_ptr<LiveJob>& job);
  TaskListener ListenerOf(const std::string& task_id);
  std::optional<TaskListener> TakeUpTask(const v1::Task& task);
  bool HasTasks(const LiveJob& job) const;
  bool BeginsTasks() const { return !stopping_ && (!draining_ || finishes_jobs_); }
  int FramesRunning(const RunningTask& task) const;
  DrainState DrainStateNow() const;
  void OnFrameEvent(RunningTask& task, const v1::WorkerEvent& event);
  void ReturnFrames(RunningTask& task, const TaskEnd& end);
  void BlameWorker(RunningTask& task, const std::string& reason);
  void Quarantine(const std::shared_ptr<LiveJob>& job, size_t position, const std::string& reason);
  void WaitForRoom(LiveJob& job, const std::string& reason);
  void Note(LiveJob& job, const std::string& text);
  void Abort(const std::shared_ptr<LiveJob>& job, v1::JobState state, const std::string& message);
  // Takes that are being recorded (job_queue_live.cpp).
  void FollowSoon(LiveJob& job);
  void AddFrames(const std::shared_ptr<LiveJob>& job, const TakeProgress& progress);
  void StopFollowingIfIdle(const std::shared_ptr<LiveJob>& job);
  void NoteLatency(LiveJob& job, size_t position);
  // Folders with what the daemon keeps of ended jobs (job_queue_retention.cpp).
  std::vector<std::string> OwnFolders() const;
  // The job's folder and its end (job_queue_results.cpp).
  bool HoldsFolder(const std::shared_ptr<LiveJob>& job);
  void RegisterAgain(const std::shared_ptr<LiveJob>& job, const std::vector<IncompleteFrame>& frames);
  void FinishIfDone(const std::shared_ptr<LiveJob>& job);
  // Writing down and telling (job_queue_save.cpp).
  void Persist(LiveJob& job, size_t position);
  void PersistJob(LiveJob& job);
  void NoteSaved(LiveJob& job, const absl::Status& status);
  void SaveAll(LiveJob& job);
  void SaveAgain();
  void Conclude(const std::shared_ptr<LiveJob>& job, v1::Job outcome);
  void End(const std::shared_ptr<LiveJob>& job);
  void PlanBackup();
  void MakeBackup(Lock& lock);
  void WakeAt(std::optional<Time>& due, Time time);
  std::optional<Time> NextDue() const;
  void DoWhatIsDue(Lock& lock);
  void MarkChanged(const LiveJob& job);
  void Forget(const std::shared_ptr<LiveJob>& job);
  void Defer(const std::shared_ptr<LiveJob>& job, std::function<void()> work);
  std::optional<Deferred> NextDeferred();

  const std::unique_ptr<Catalogue> catalogue_;
  const std::unique_ptr<Executor> executor_;
  const JobQueueOptions options_;

  std::mutex mutex_;
  std::condition_variable job_ended_;
  // Unfinished ones by priority and age, and ended ones that are watched.
  std::list<std::shared_ptr<LiveJob>> jobs_;
  std::map<std::string, std::unique_ptr<RunningTask>> tasks_;
  Turns turns_;  // at the workers
  std::map<int64_t, std::unique_ptr<Watcher>> watchers_;
  int64_t next_watcher_ = 1;
  int64_t next_task_ = 1;
  bool stopping_ = false;
  bool draining_ = false;
  bool finishes_jobs_ = false;  // before it is drained

  std::vector<std::function<void()>> to_tell_;
  std::condition_variable deferred_changed_;
  std::list<Deferred> deferred_;
  std::set<const LiveJob*> in_background_;
  Turns background_turns_;
  bool due_changed_ = false;
  std::optional<Time> save_again_, backup_due_, last_backup_;
  int64_t backed_up_version_ = 0;
  PublishedJobs published_;  // as MarkChanged told last
  int64_t frames_done_ = 0, frames_failed_ = 0;
  std::string catalogue_trouble_, backup_trouble_;  // "" while all is well
  bool background_ends_ = false;
  std::vector<std::thread> background_;
};

}  // namespace weft
