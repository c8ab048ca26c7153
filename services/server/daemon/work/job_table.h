// The daemon's jobs and tasks as a table: what they are at, and what follows from what happens. No threads,
// no disk, no clock: whoever owns the table calls it in turn, says what time it is, and does its JobEffects.
#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/take/take_progress.h"
#include "services/server/access/call_limits.h"
#include "services/server/callers/turns.h"
#include "services/work/executor/executor.h"
#include "services/work/job/job_life.h"
#include "weft/v1/access.pb.h"
#include "weft/v1/task.pb.h"

namespace weft {

using JobTime = std::chrono::steady_clock::time_point;

// A job that has not ended, or that somebody watches. Its owner reads it; the table alone changes it.
struct TableJob {
  explicit TableJob(JobLife begun) : life(std::move(begun)) {}

  const v1::Job& job() const { return life.job(); }
  const std::string& id() const { return life.job().id(); }
  const std::string& caller() const { return life.job().submitted_by(); }
  const std::vector<v1::FrameInfo>& infos() const { return life.frames().infos(); }
  // What is to be written down of it: its outcome, once it has one.
  v1::Job LastState() const { return outcome ? *outcome : life.Describe(); }

  JobLife life;
  bool reserved = true;            // it is not written down yet: nobody sees it, no task begins
  bool taking_folder = false;      // the lock of its results is being taken
  bool has_folder = false;         // and was, so that tasks may begin now
  bool checking = false;           // its results are being looked at; no task of it runs
  bool checked = false;            // they are all there
  bool finishing = false;          // its last files are being written
  bool ended = false;              // and that is written down
  std::optional<v1::Job> outcome;  // its last state, until it is written down
  // Set while a disk has no room for its tasks.
  std::optional<JobTime> start_again;
  std::chrono::seconds pause{1};
  // Of a job that follows a take: when to look for new frame sets, and what was there the last time.
  std::optional<JobTime> look_at;
  std::vector<int64_t> recorded_ns;  // per frame, CLOCK_REALTIME
  bool take_settled = false, take_closed = false;
  int failed_starts = 0;  // workers in a row that ended before they began a frame
  int notes = 0;          // warnings about its tasks
  uint64_t version = 1;   // counts changes of the job beside its frames
};
using JobRef = std::shared_ptr<TableJob>;

// What is to be done since the last call of JobTable::TakeEffects.
struct JobEffects {
  enum class Files { kTakeFolder, kCheck, kFinish, kLookAtTake };
  enum class Level { kDebug, kInfo, kWarning, kError };
  struct Quarantined {
    JobRef job;
    v1::FrameInfo frame;
  };

  std::map<JobRef, std::set<size_t>> changed;  // jobs to be written down, with these frames
  std::vector<JobRef> concluded;               // their outcome, with all frames; then Saved
  std::vector<JobRef> shown;                   // for watchers alone
  std::vector<std::string> stop_tasks;
  std::vector<std::pair<JobRef, Files>> files;  // to be read or written, for one job after the other
  std::vector<Quarantined> quarantined;         // frames that get a report
  std::vector<std::pair<Level, std::string>> log;

  bool empty() const {
    return changed.empty() && concluded.empty() && shown.empty() && stop_tasks.empty() && files.empty() &&
           quarantined.empty() && log.empty();
  }
};

struct JobTableOptions {
  int max_of_one_caller = CallerLimits().jobs;  // unfinished
  bool checks_results = true;                   // before a job is done
  int threads_per_worker = 1;
};

// A task that is to be started.
struct PlannedTask {
  JobRef job;
  v1::Task task;
};

// Of the jobs of the highest class of priorities (owners.h), callers take turns (turns.h), each with its job
// of the highest priority, and of those the oldest. Tasks that run are not interrupted. A frame whose worker
// ends abnormally is tried again, kMaxAttempts times in all. The daemon's own end, full disks and lost
// machines count against no frame and no job. Thread safety: none.
class JobTable {
 public:
  explicit JobTable(JobTableOptions options) : options_(options) {}

  // Jobs (job_table.cpp).
  // A place for a job, which counts from now on. FailedPrecondition: another unfinished job writes to the
  // same folder. ResourceExhausted: too many jobs wait, by the share of who submitted it. Unavailable: Stop
  // was called.
  absl::StatusOr<JobRef> Reserve(JobLife life, v1::Role role);
  // It is written down; others see it, and its tasks may begin.
  void Activate(const JobRef& reserved, JobTime now);
  // One that a daemon before this one left. `checks`: its results are looked at first.
  JobRef Resume(JobLife life, JobTime now);
  // Its last state, of which the caller writes the files; then OnFinished. `bridged`: JobLife::Outcome.
  v1::Job Outcome(const JobRef& job, const std::vector<size_t>& bridged) {
    return job->life.Outcome(bridged);
  }
  // One that has ended, for those who watch it.
  JobRef AddEnded(JobLife life);
  // The unfinished one of this id, or an ended one that is watched. Null: there is none.
  JobRef Find(const std::string& job_id) const;
  // Unfinished ones by priority and age, then ended ones.
  const std::list<JobRef>& jobs() const { return jobs_; }
  void SetPriority(const JobRef& job, int priority);
  // The job is to end before all frames are dealt with. One that ends already stays as it is.
  void Abort(const JobRef& job, v1::JobState state, const std::string& message);
  // Lets go of one that has ended, or of a place.
  void Forget(const JobRef& job) { jobs_.remove(job); }

  // Tasks (job_table_tasks.cpp).
  // The next task to be started where the executor has a free slot. Jobs without a folder get kTakeFolder
  // first. A slot is kept for a job whose folder is being taken.
  std::optional<PlannedTask> NextTask(int slots, const TaskShape& shape);
  // No further NextTask for now: folders are taken anew before the next one.
  void EndRound();
  void Began(const PlannedTask& task, const std::string& task_logs, JobTime now);
  // Its job waits a moment, and longer each time.
  void CouldNotBegin(const PlannedTask& task, const std::string& why, JobTime now);
  // A task that the daemon before this one started, and that runs on. False: no job waits for a frame of it.
  bool TakeUp(const v1::Task& task, const std::string& task_logs, JobTime now);
  void OnEvent(const std::string& task_id, const v1::WorkerEvent& event, int64_t host_time_ns);
  void OnTaskEnded(const std::string& task_id, const TaskEnd& end, JobTime now);
  void OnTaskWaits(const std::string& task_id, const std::string& why);
  void OnTaskNoted(const std::string& task_id, const std::string& note);

  // Files (job_table_files.cpp): what became of JobEffects::files.
  void OnFolderTaken(const JobRef& job, const absl::Status& status, JobTime now);
  void OnChecked(const JobRef& job, const absl::StatusOr<std::vector<IncompleteFrame>>& incomplete,
                 JobTime now);
  // `outcome`, the last state of the job, where its files are written; otherwise `status` says why not.
  void OnFinished(const JobRef& job, v1::Job outcome, const absl::Status& status, JobTime now);
  // Of a take that is being recorded. `is_settled`: no recovery of it is due.
  void OnTakeSeen(const JobRef& job, bool is_settled, const absl::StatusOr<const TakeProgress*>& progress,
                  int64_t host_time_ns, JobTime now);
  // The outcome is written down.
  void Saved(const JobRef& job);
  // It cannot be written down yet.
  void CouldNotSave(const JobRef& job, const std::string& trouble);

  // Time.
  std::optional<JobTime> NextDue() const;
  void DoWhatIsDue(JobTime now);

  // The end.
  struct DrainState {
    int tasks = 0;   // that workers have
    int frames = 0;  // that workers are at
    int jobs = 0;    // that have not ended
    bool is_drained = false;
  };
  // Takes no new tasks, and has workers stop after the frame that they are at. `finish_jobs`: jobs go on
  // until all have ended. The last call counts. `is_queued`: TaskShape::is_queued.
  void Drain(bool finish_jobs, bool is_queued);
  DrainState CurrentDrain() const;
  void Stop() { stopping_ = true; }
  bool stopping() const { return stopping_; }

  int64_t frames_done() const { return frames_done_; }
  int64_t frames_failed() const { return frames_failed_; }
  JobEffects TakeEffects();

 private:
  struct RunningTask {
    JobRef job;
    std::vector<size_t> positions;
    std::optional<v1::TaskError> error;
    std::optional<v1::WorkerUsage> usage;
    JobTime handed_out;
    bool began = false;
    bool is_taken_up = false;  // it tells again what it told the daemon before this one
  };

  absl::Status CheckRoom(const v1::Job& job, v1::Role role) const;
  enum class Place { kLast, kByAge };  // among those of its priority
  void Insert(const JobRef& job, Place place);
  bool BeginsTasks() const { return !stopping_ && (!draining_ || finishes_jobs_); }
  bool MayBeginTask(const TableJob& job) const;
  JobRef NextJob();
  bool HasTasks(const TableJob& job) const;
  int FramesRunning(const RunningTask& task) const;
  void OnFrameEvent(RunningTask& task, const v1::WorkerEvent& event, int64_t host_time_ns);
  void ReturnFrames(RunningTask& task, const TaskEnd& end, JobTime now);
  void BlameWorker(RunningTask& task, const std::string& reason);
  void Quarantine(const JobRef& job, size_t position, const std::string& reason);
  void WaitForRoom(const JobRef& job, const std::string& reason, JobTime now);
  void Note(const JobRef& job, const std::string& text);
  void AddFrames(const JobRef& job, const TakeProgress& progress, int64_t host_time_ns, JobTime now);
  void StopFollowingIfIdle(const JobRef& job);
  void FinishIfDone(const JobRef& job);

  void ChangeFrame(const JobRef& job, size_t position);
  void ChangeJob(const JobRef& job);
  void ChangeAll(const JobRef& job);
  void Show(const JobRef& job);
  void Log(JobEffects::Level level, std::string text) { effects_.log.emplace_back(level, std::move(text)); }

  const JobTableOptions options_;
  std::list<JobRef> jobs_;
  std::map<std::string, std::unique_ptr<RunningTask>> tasks_;
  Turns turns_;  // at the workers
  int64_t next_task_ = 1;
  bool stopping_ = false, draining_ = false, finishes_jobs_ = false;
  int64_t frames_done_ = 0, frames_failed_ = 0;
  JobEffects effects_;
};

}  // namespace weft
