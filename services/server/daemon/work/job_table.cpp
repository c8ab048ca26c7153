#include "services/server/daemon/work/job_table.h"

#include <algorithm>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/server/callers/fair_share.h"
#include "services/server/callers/owners.h"
#include "services/server/rpc/error_detail.h"

namespace weft {
namespace {

constexpr int64_t kMostUnfinishedJobs = 1000, kReservedJobs = 50;  // in all; of them for operators

}  // namespace

absl::Status JobTable::CheckRoom(const v1::Job& job, v1::Role role) const {
  if (stopping_) return absl::UnavailableError("the daemon is shutting down");
  FairShare share(
      {.all = kMostUnfinishedJobs, .of_one_caller = options_.max_of_one_caller, .reserve = kReservedJobs},
      "unfinished jobs");
  for (const JobRef& other : jobs_) {
    if (!other->ended) share.Take(other->caller());
  }
  WEFT_RETURN_IF_ERROR(share.Check({job.submitted_by(), role}));
  for (const JobRef& other : jobs_) {
    const std::string& out = other->job().spec().out();
    const bool is_theirs = !IsSameAccount(other->caller(), job.submitted_by()) &&
                           absl::StartsWith(job.spec().out(), absl::StrCat(out, "/"));
    if (other->ended || (out != job.spec().out() && !is_theirs)) continue;
    return FieldError(absl::StatusCode::kFailedPrecondition,
                      {"spec.out", absl::StrCat(out, " is where job ", other->id(), " writes"),
                       "wait until it has ended, or cancel it"});
  }
  return absl::OkStatus();
}

void JobTable::Insert(const JobRef& job, Place place) {
  const v1::Job& ours = job->job();
  const auto later = std::find_if(jobs_.begin(), jobs_.end(), [&](const JobRef& other) {
    if (other->ended) return false;
    const v1::Job& theirs = other->job();
    return theirs.priority() < ours.priority() ||
           (place == Place::kByAge && theirs.priority() == ours.priority() &&
            theirs.created_unix_ns() > ours.created_unix_ns());
  });
  jobs_.insert(later, job);
}

absl::StatusOr<JobRef> JobTable::Reserve(JobLife life, v1::Role role) {
  WEFT_RETURN_IF_ERROR(CheckRoom(life.job(), role));
  auto job = std::make_shared<TableJob>(std::move(life));
  Insert(job, Place::kLast);
  return job;
}

void JobTable::Activate(const JobRef& reserved, JobTime now) {
  reserved->reserved = false;
  if (reserved->life.following()) reserved->look_at = now;
  Show(reserved);
}

JobRef JobTable::Resume(JobLife life, JobTime now) {
  const auto job = std::make_shared<TableJob>(std::move(life));
  Insert(job, Place::kLast);
  job->reserved = false;
  // The daemon's own end is no fault of the frames that ran.
  for (size_t i = 0; i < job->infos().size(); ++i) {
    if (job->infos()[i].state() != v1::FRAME_STATE_RUNNING) continue;
    job->life.frames().Requeue(i, JobFrames::Attempt::kDaemonKilled);
    ChangeFrame(job, i);
  }
  if (job->life.is_aborted()) job->life.CancelWaiting([](size_t) { return false; });
  if (job->life.following()) job->look_at = now;
  const v1::FrameCounts counts = job->life.frames().Counts();
  // While it follows a take, its frames are computed by themselves, which is not what its results will be.
  if (options_.checks_results && !job->life.is_aborted() && !job->life.following() &&
      counts.done() + counts.degraded() + counts.failed() > 0) {
    job->checking = true;
    effects_.files.emplace_back(job, JobEffects::Files::kCheck);
  }
  Log(JobEffects::Level::kInfo,
      absl::StrCat("job ", job->id(), " is resumed: ", job->life.frames().FramesLeft(), " frames left"));
  Show(job);
  FinishIfDone(job);
  return job;
}

JobRef JobTable::AddEnded(JobLife life) {
  const auto job = std::make_shared<TableJob>(std::move(life));
  job->reserved = false;
  job->ended = true;
  jobs_.push_back(job);
  return job;
}

JobRef JobTable::Find(const std::string& job_id) const {
  JobRef found;
  for (const JobRef& job : jobs_) {
    if (job->id() != job_id || job->reserved) continue;
    found = job;
    // Those who watched it to its end before it was retried still hold the other one.
    if (!job->ended) break;
  }
  return found;
}

void JobTable::SetPriority(const JobRef& job, int priority) {
  job->life.SetPriority(priority);
  jobs_.remove(job);
  Insert(job, Place::kByAge);  // as if it had been submitted with it
  ChangeJob(job);
}

void JobTable::Abort(const JobRef& job, v1::JobState state, const std::string& message) {
  if (job->ended || job->finishing || job->life.is_aborted()) return;
  Log(JobEffects::Level::kInfo, absl::StrCat("job ", job->id(), " ends early: ", message));
  job->life.Abort(state, message);
  job->start_again.reset();  // its end need not wait for what its tasks waited for
  // Frames of running tasks come back when those have ended.
  std::vector<bool> in_task(job->infos().size());
  for (const auto& [id, task] : tasks_) {
    if (task->job != job) continue;
    for (const size_t position : task->positions) in_task[position] = true;
    effects_.stop_tasks.push_back(id);
  }
  job->life.CancelWaiting([&in_task](size_t position) { return in_task[position]; });
  job->life.SetMessage(state == v1::JOB_STATE_CANCELLED ? "being cancelled" : job->life.abort_message());
  ChangeJob(job);
  FinishIfDone(job);
}

void JobTable::Saved(const JobRef& job) {
  if (!job->outcome) return;
  job->life.Conclude(*std::exchange(job->outcome, std::nullopt));
  job->ended = true;
  ++job->version;
  Show(job);
}

void JobTable::CouldNotSave(const JobRef& job, const std::string& trouble) {
  if (!job->outcome) return;
  job->life.SetMessage(
      absl::StrCat("all frames are dealt with; its end cannot be written down yet: ", trouble));
  ++job->version;
  Show(job);
}

std::optional<JobTime> JobTable::NextDue() const {
  std::optional<JobTime> next;
  for (const JobRef& job : jobs_) {
    for (const std::optional<JobTime>& due : {job->start_again, job->look_at})
      if (due) next = next ? std::min(*next, *due) : *due;
  }
  return next;
}

void JobTable::DoWhatIsDue(JobTime now) {
  for (const JobRef& job : std::list(jobs_)) {
    if (job->look_at && *job->look_at <= now) {
      job->look_at.reset();
      if (!job->ended) effects_.files.emplace_back(job, JobEffects::Files::kLookAtTake);
    }
    if (job->start_again && *job->start_again <= now) {
      job->start_again.reset();
      FinishIfDone(job);
    }
  }
}

JobTable::DrainState JobTable::CurrentDrain() const {
  DrainState state;
  state.tasks = static_cast<int>(tasks_.size());
  for (const auto& [id, task] : tasks_) state.frames += FramesRunning(*task);
  state.jobs = static_cast<int>(
      std::count_if(jobs_.begin(), jobs_.end(), [](const JobRef& job) { return !job->ended; }));
  state.is_drained = draining_ && tasks_.empty() && (!finishes_jobs_ || state.jobs == 0);
  return state;
}

void JobTable::Drain(bool finish_jobs, bool is_queued) {
  draining_ = true;
  finishes_jobs_ = finish_jobs;
  if (BeginsTasks()) return;
  for (const auto& [id, task] : tasks_) {
    if ((task->began || is_queued) && FramesRunning(*task) == 0) effects_.stop_tasks.push_back(id);
  }
}

void JobTable::ChangeFrame(const JobRef& job, size_t position) { effects_.changed[job].insert(position); }

void JobTable::ChangeJob(const JobRef& job) {
  ++job->version;
  effects_.changed[job];
}

void JobTable::ChangeAll(const JobRef& job) {
  ChangeJob(job);
  for (size_t position = 0; position < job->infos().size(); ++position) ChangeFrame(job, position);
}

void JobTable::Show(const JobRef& job) { effects_.shown.push_back(job); }

JobEffects JobTable::TakeEffects() { return std::exchange(effects_, JobEffects()); }

}  // namespace weft
