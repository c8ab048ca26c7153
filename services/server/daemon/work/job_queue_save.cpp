// JobQueue: what is written down, and what is done in the background.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/job_queue_state.h"

namespace weft {
namespace {

constexpr std::chrono::seconds kSaveAgainAfter{1};
// A backup follows a new job and the end of one, the first at once.
constexpr std::chrono::seconds kBackupAfter{1};
constexpr std::chrono::seconds kBackupPeriod{60};

}  // namespace

// Watchers are told of states that the disk has not taken yet: a restart does those frames again. The end of
// a job is told when it is written down (Conclude).
void JobQueue::Persist(LiveJob& live, size_t position) {
  if (!live.unsaved)
    NoteSaved(live, catalogue_->UpdateFrame(live.job().id(), position, live.infos()[position]));
  MarkChanged(live);
}

void JobQueue::PersistJob(LiveJob& live) {
  ++live.version;
  if (!live.unsaved) NoteSaved(live, catalogue_->UpdateJob(live.life.Describe()));
  MarkChanged(live);
}

void JobQueue::NoteSaved(LiveJob& live, const absl::Status& status) {
  live.unsaved = !status.ok();
  if (status.ok()) return;
  if (catalogue_trouble_.empty())
    spdlog::error("{}; it is tried again until it works", std::string(status.message()));
  catalogue_trouble_ = std::string(status.message());
  WakeAt(save_again_, std::chrono::steady_clock::now() + kSaveAgainAfter);
}

void JobQueue::SaveAll(LiveJob& live) {
  const v1::Job job = live.outcome ? *live.outcome : live.life.Describe();
  absl::Status status = catalogue_->UpdateAll(job, live.infos());
  // Its row was damaged while the daemon ran.
  if (absl::IsNotFound(status)) status = catalogue_->AddJob(job, live.infos());
  NoteSaved(live, status);
}

void JobQueue::SaveAgain() {
  const std::list<std::shared_ptr<LiveJob>> jobs = jobs_;
  for (const std::shared_ptr<LiveJob>& live : jobs) {
    if (!live->unsaved) continue;
    SaveAll(*live);
    if (live->unsaved) return;
    if (live->outcome) End(live);
  }
  if (!catalogue_trouble_.empty()) spdlog::info("the catalogue is written again");
  catalogue_trouble_.clear();
}

void JobQueue::Conclude(const std::shared_ptr<LiveJob>& live, v1::Job outcome) {
  live->outcome = std::move(outcome);
  SaveAll(*live);
  if (!live->unsaved) return End(live);
  live->life.SetMessage(
      absl::StrCat("all frames are dealt with; its end cannot be written down yet: ", catalogue_trouble_));
  ++live->version;
  MarkChanged(*live);
}

void JobQueue::End(const std::shared_ptr<LiveJob>& live) {
  live->life.Conclude(*std::exchange(live->outcome, std::nullopt));
  live->ended = true;
  ++live->version;
  MarkChanged(*live);
  Forget(live);
  PlanBackup();
  job_ended_.notify_all();
}

void JobQueue::PlanBackup() {
  if (backup_due_) return;
  const Time now = std::chrono::steady_clock::now();
  WakeAt(backup_due_,
         last_backup_ ? std::max(now + kBackupAfter, *last_backup_ + kBackupPeriod) : now + kBackupAfter);
}

// Lets go of the lock between steps, so that nobody waits for it.
void JobQueue::MakeBackup(Lock& lock) {
  backup_due_.reset();
  const int64_t version = catalogue_->version();
  if (last_backup_ && version == backed_up_version_) return;
  absl::StatusOr<std::unique_ptr<CatalogueBackup>> backup = catalogue_->StartBackup();
  absl::Status status = backup.status();
  for (bool complete = false; status.ok() && !complete;) {
    const absl::StatusOr<bool> step = (*backup)->Step();
    status = step.status();
    complete = step.ok() && *step;
    lock.unlock();
    std::this_thread::yield();
    if (complete) status = (*backup)->Keep();
    lock.lock();
  }
  last_backup_ = std::chrono::steady_clock::now();
  if (status.ok()) {
    backed_up_version_ = version;
    backup_trouble_.clear();
    return;
  }
  if (backup_trouble_.empty()) spdlog::warn("no backup of the catalogue: {}", std::string(status.message()));
  backup_trouble_ = absl::StrCat("no backup of the list of jobs: ", absl::string_view(status.message()));
  PlanBackup();
}

void JobQueue::MarkChanged(const LiveJob& job) {
  published_.Publish(job.life.Describe());
  for (const auto& [id, watcher] : watchers_) {
    if (watcher->job.get() == &job) to_tell_.push_back(watcher->changed);
  }
}

void JobQueue::UnlockAndTell(Lock& lock) {
  std::vector<std::function<void()>> to_tell;
  to_tell.swap(to_tell_);
  lock.unlock();
  for (const auto& tell : to_tell) tell();
}

void JobQueue::Forget(const std::shared_ptr<LiveJob>& job) {
  if (job->ended && job->watchers == 0) jobs_.remove(job);
}

void JobQueue::Defer(const std::shared_ptr<LiveJob>& job, std::function<void()> work) {
  deferred_.push_back({job, std::move(work)});
  deferred_changed_.notify_all();
}

void JobQueue::WakeAt(std::optional<Time>& due, Time time) {
  due = time;
  due_changed_ = true;
  deferred_changed_.notify_all();
}

std::optional<JobQueue::Time> JobQueue::NextDue() const {
  std::optional<Time> next;
  const auto consider = [&next](const std::optional<Time>& due) {
    if (due) next = next ? std::min(*next, *due) : *due;
  };
  consider(save_again_);
  consider(backup_due_);
  for (const auto& job : jobs_) {
    consider(job->start_again);
    consider(job->look_at);
  }
  return next;
}

void JobQueue::DoWhatIsDue(Lock& lock) {
  const Time now = std::chrono::steady_clock::now();
  if (save_again_ && *save_again_ <= now) {
    save_again_.reset();
    SaveAgain();
  }
  for (const auto& job : jobs_) {
    if (!job->look_at || *job->look_at > now) continue;
    job->look_at.reset();
    if (!job->ended) Defer(job, [this, job] { LookAtTake(job); });
  }
  for (const auto& job : std::list(jobs_)) {
    if (!job->start_again || *job->start_again > now) continue;
    job->start_again.reset();
    FinishIfDone(job);
    Schedule();
  }
  if (backup_due_ && *backup_due_ <= now) MakeBackup(lock);
  UnlockAndTell(lock);
  lock.lock();
}

// Results that are slow to read keep one thread of their caller's, or two; the others' jobs end meanwhile.
std::optional<JobQueue::Deferred> JobQueue::NextDeferred() {
  constexpr int kOfOneCaller = 2;
  std::set<const LiveJob*> seen;
  std::vector<std::list<Deferred>::iterator> may_begin;
  std::vector<std::string> callers;
  for (auto at = deferred_.begin(); at != deferred_.end(); ++at) {
    if (!seen.insert(at->job.get()).second || in_background_.contains(at->job.get())) continue;
    const std::string& caller = at->job->job().submitted_by();
    if (background_turns_.Running(caller) >= kOfOneCaller) continue;
    may_begin.push_back(at);
    callers.push_back(caller);
  }
  if (may_begin.empty()) return std::nullopt;
  const auto next = may_begin[background_turns_.Next(callers)];
  Deferred deferred = std::move(*next);
  deferred_.erase(next);
  return deferred;
}

void JobQueue::WorkInBackground(bool is_first) {
  Lock lock(mutex_);
  for (;;) {
    if (std::optional<Deferred> next = NextDeferred()) {
      const std::string caller = next->job->job().submitted_by();
      in_background_.insert(next->job.get());
      background_turns_.Begin(caller);
      const Time began = std::chrono::steady_clock::now();
      lock.unlock();
      next->work();
      lock.lock();
      background_turns_.End(caller,
                            std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
      in_background_.erase(next->job.get());
      deferred_changed_.notify_all();
      continue;
    }
    if (background_ends_ && deferred_.empty() && (!is_first || in_background_.empty())) break;
    const std::optional<Time> due = is_first ? NextDue() : std::nullopt;
    if (is_first && (due_changed_ || (due && *due <= std::chrono::steady_clock::now()))) {
      due_changed_ = false;
      DoWhatIsDue(lock);
    } else if (due) {
      deferred_changed_.wait_until(lock, *due);
    } else {
      deferred_changed_.wait(lock);
    }
  }
  if (!is_first) return;
  SaveAgain();
  if (catalogue_trouble_.empty()) MakeBackup(lock);
}

}  // namespace weft
