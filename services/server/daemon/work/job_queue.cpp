#include "services/server/daemon/work/job_queue.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/catalogue/message_text.h"

namespace weft {
namespace {

constexpr std::chrono::seconds kCancelTimeout{45};  // less than the client's
constexpr std::chrono::seconds kFlushTimeout{10};
constexpr std::chrono::milliseconds kTakeUpTimeout{200};

JobTime Now() { return std::chrono::steady_clock::now(); }

absl::Status ShuttingDown() { return absl::UnavailableError("the daemon is shutting down"); }

}  // namespace

JobQueue::JobFiles::JobFiles(const v1::Job& job)
    : folder(job.spec().out(), absl::StrCat("job ", job.id(), " of weftd")) {}

JobQueue::JobQueue(std::unique_ptr<Catalogue> catalogue, std::unique_ptr<Executor> executor,
                   JobQueueOptions options)
    : executor_(std::move(executor)),
      options_(std::move(options)),
      table_({.max_of_one_caller = options_.max_of_one_caller,
              .checks_results = static_cast<bool>(options_.find_incomplete),
              .threads_per_worker = options_.threads_per_worker}) {
  store_ = std::make_unique<JobStore>(std::move(catalogue));
}

absl::StatusOr<std::unique_ptr<JobQueue>> JobQueue::Create(std::unique_ptr<Catalogue> catalogue,
                                                           std::unique_ptr<Executor> executor,
                                                           JobQueueOptions options) {
  std::unique_ptr<JobQueue> queue(
      new JobQueue(std::move(catalogue), std::move(executor), std::move(options)));
  constexpr int kResultThreads = 3;
  queue->background_.emplace_back(&JobQueue::WorkInBackground, queue.get(), Lane::kFolders);
  for (int i = 0; i < kResultThreads; ++i)
    queue->background_.emplace_back(&JobQueue::WorkInBackground, queue.get(), Lane::kResults);
  WEFT_RETURN_IF_ERROR(queue->Resume());
  return queue;
}

JobQueue::~JobQueue() { Stop(); }

absl::Status JobQueue::Resume() {
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::Job> unfinished, store_->disk().UnfinishedJobs());
  Lock lock(mutex_);
  for (v1::Job& job : unfinished) {
    absl::StatusOr<std::vector<v1::FrameInfo>> infos = store_->disk().ReadFrames(job.id());
    if (infos.ok()) {
      const JobRef ref = table_.Resume(JobLife(std::move(job), *std::move(infos)), Now());
      files_.emplace(ref, std::make_shared<JobFiles>(ref->job()));
    } else {
      spdlog::error("job {} cannot be taken up: {}", job.id(), std::string(infos.status().message()));
    }
  }
  executor_->TakeUp([this](const v1::Task& task) {
    mutex_.AssertHeld();
    return TakeUpTask(task);
  });
  Settle(lock);
  return absl::OkStatus();
}

// A task that the daemon before this one started, and that runs on. None: no job waits for a frame of it.
std::optional<TaskListener> JobQueue::TakeUpTask(const v1::Task& task) {
  const JobRef job = table_.Find(task.job_id());
  if (job != nullptr && !job->ended) {
    const absl::Status taken = files_.at(job)->folder.Take(kTakeUpTimeout);
    table_.OnFolderTaken(job, taken, Now());
    if (!taken.ok()) return std::nullopt;
  }
  if (!table_.TakeUp(task, executor_->LogFolder(task.job_id()), Now())) return std::nullopt;
  return ListenerOf(task.id());
}

TaskListener JobQueue::ListenerOf(const std::string& id) {
  return {[this, id](const v1::WorkerEvent& event) {
            Lock lock(mutex_);
            table_.OnEvent(id, event, HostTime_ns());
            Settle(lock);
          },
          [this, id](const TaskEnd& end) {
            Lock lock(mutex_);
            table_.OnTaskEnded(id, end, Now());
            Settle(lock);
          },
          [this, id](const std::string& why) {
            Lock lock(mutex_);
            table_.OnTaskWaits(id, why);
            Settle(lock);
          },
          [this, id](const std::string& note) {
            Lock lock(mutex_);
            table_.OnTaskNoted(id, note);
            Settle(lock);
          }};
}

absl::Status JobQueue::Submit(v1::Job job, const std::vector<std::string>& frames, v1::Role role) {
  WEFT_RETURN_IF_ERROR(options_.admit());
  for (const std::string& frame : frames) {
    if (IsUtf8(frame)) continue;
    return absl::InvalidArgumentError(absl::StrCat(job.spec().dump(), ": the name of frame ",
                                                   EscapedText(frame), " is not UTF-8 text; rename it"));
  }
  EscapeTexts(job);
  Lock lock(mutex_);
  WEFT_ASSIGN_OR_RETURN(const JobRef ref, table_.Reserve(JobLife(std::move(job), frames), role));
  lock.unlock();
  const absl::Status added = store_->disk().AddJob(ref->job(), ref->infos());
  lock.lock();
  if (!added.ok()) {
    table_.Forget(ref);
    return added;
  }
  spdlog::info("job {}: {} frames of {}, results to {}", ref->id(), frames.size(), ref->job().spec().dump(),
               ref->job().spec().out());
  files_.emplace(ref, std::make_shared<JobFiles>(ref->job()));
  table_.Activate(ref, Now());
  Settle(lock);
  return absl::OkStatus();
}

absl::StatusOr<v1::Job> JobQueue::Cancel(const std::string& job_id) {
  Lock lock(mutex_);
  const JobRef job = table_.Find(job_id);
  if (job == nullptr) {
    lock.unlock();
    return store_->disk().ReadJob(job_id);
  }
  table_.Abort(job, v1::JOB_STATE_CANCELLED, "cancelled");
  Settle(lock);
  lock.lock();
  job_ended_.wait_for(lock, kCancelTimeout, [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return job->ended || table_.stopping();
  });
  if (job->ended) return job->life.Describe();
  if (table_.stopping()) return ShuttingDown();
  lock.unlock();
  const std::string trouble = store_->Trouble();
  const std::string says =
      absl::StrCat("job ", job_id, " is being cancelled; its end is not written down yet");
  if (trouble.empty()) return absl::AbortedError(absl::StrCat(says, ", ask again"));
  return absl::ResourceExhaustedError(absl::StrCat(says, ": ", trouble));
}

absl::StatusOr<v1::Job> JobQueue::Retry(const std::string& job_id, v1::Role role) {
  const MutexLock one_at_a_time(retrying_);
  Lock lock(mutex_);
  if (const JobRef live = table_.Find(job_id); live && !live->ended) return live->life.Describe();
  lock.unlock();
  absl::StatusOr<v1::Job> job = store_->disk().ReadJob(job_id);
  if (!job.ok()) return job;
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::FrameInfo> frames, store_->disk().ReadFrames(job_id));
  JobLife life(*job, std::move(frames));
  if (!life.Retry()) return job;
  WEFT_RETURN_IF_ERROR(options_.admit());
  lock.lock();
  WEFT_ASSIGN_OR_RETURN(const JobRef again, table_.Reserve(std::move(life), role));
  lock.unlock();
  const absl::Status written = store_->disk().UpdateAll(again->life.Describe(), again->infos());
  lock.lock();
  if (!written.ok()) {
    table_.Forget(again);
    return written;
  }
  spdlog::info("job {} is retried: {} frames left", job_id, again->life.frames().FramesLeft());
  files_.emplace(again, std::make_shared<JobFiles>(again->job()));
  table_.Activate(again, Now());
  job = again->life.Describe();
  Settle(lock);
  return job;
}

absl::StatusOr<v1::Job> JobQueue::SetPriority(const std::string& job_id, int priority) {
  Lock lock(mutex_);
  const JobRef job = table_.Find(job_id);
  if (job == nullptr || job->ended) {
    lock.unlock();
    return store_->disk().ReadJob(job_id);
  }
  lock.unlock();
  // On the disk before it is answered, as a submission is.
  WEFT_RETURN_IF_ERROR(store_->disk().KeepPriority(job_id, priority));
  lock.lock();
  if (!job->ended) table_.SetPriority(job, priority);
  v1::Job now = job->life.Describe();
  Settle(lock);
  return now;
}

JobQueue::DrainState JobQueue::Drain(bool finish_jobs) {
  Lock lock(mutex_);
  table_.Drain(finish_jobs, executor_->shape().is_queued);
  const DrainState state = table_.CurrentDrain();
  Settle(lock);
  return state;
}

void JobQueue::ForgetIfUnwatched(const JobRef& job) {
  if (!job->ended || watchers_.AreAny(job)) return;
  table_.Forget(job);
  files_.erase(job);
}

void JobQueue::OnSaved(const JobRef& job) {
  Lock lock(mutex_);
  table_.Saved(job);
  job_ended_.notify_all();
  ForgetIfUnwatched(job);
  Settle(lock, Telling::kAtOnce);
}

void JobQueue::OnRefused(const JobRef& job, const std::string& why) {
  Lock lock(mutex_);
  table_.CouldNotSave(job, why);
  Settle(lock, Telling::kAtOnce);
}

void JobQueue::StartTasks() {
  while (const std::optional<PlannedTask> planned = table_.NextTask(executor_->slots(), executor_->shape())) {
    const absl::Status started = executor_->Start(planned->task, ListenerOf(planned->task.id()));
    if (!started.ok()) {
      table_.CouldNotBegin(*planned, std::string(started.message()), Now());
      break;
    }
    table_.Began(*planned, executor_->LogFolder(planned->job->id()), Now());
  }
  table_.EndRound();
}

void JobQueue::Publish(const JobRef& job) {
  published_.Publish(job->life.Describe());
  watchers_.Collect(job, &to_call_);
}

// Whether there were any.
bool JobQueue::DoEffects() {
  const JobEffects effects = table_.TakeEffects();
  for (const auto& [level, text] : effects.log) {
    constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::debug, spdlog::level::info,
                                                     spdlog::level::warn, spdlog::level::err};
    spdlog::log(kLevels[static_cast<int>(level)], "{}", text);
  }
  for (const std::string& task : effects.stop_tasks) executor_->Stop(task);
  for (const auto& [job, positions] : effects.changed) {
    std::map<size_t, v1::FrameInfo> frames;
    for (const size_t position : positions) frames.emplace(position, job->infos()[position]);
    store_->Put(job->LastState(), frames);
    to_flush_.insert(job->id());
    Publish(job);
  }
  for (const JobRef& job : effects.concluded) {
    store_->PutLast(
        *job->outcome, job->infos(), [this, job] { OnSaved(job); },
        [this, job](const std::string& why) { OnRefused(job, why); });
  }
  for (const JobRef& job : effects.shown) Publish(job);
  for (const auto& [job, what] : effects.files) Defer(job, what);
  for (const JobEffects::Quarantined& one : effects.quarantined) DeferReport(one);
  return !effects.empty();
}

void JobQueue::Settle(Lock& lock, Telling telling) {
  do {
    StartTasks();
  } while (DoEffects());
  deferred_changed_.notify_all();  // something may be due at another time
  const std::vector<std::function<void()>> to_call = std::exchange(to_call_, {});
  std::set<std::string> to_flush;
  if (telling == Telling::kWhenWritten) to_flush.swap(to_flush_);
  lock.unlock();
  for (const std::string& job : to_flush) store_->Flush(job, kFlushTimeout).IgnoreError();
  for (const auto& call : to_call) call();
}

void JobQueue::Stop() {
  {
    Lock lock(mutex_);
    if (is_stopped_) return;
    is_stopped_ = true;
    table_.Stop();
    watchers_.CollectAll(&to_call_);
    job_ended_.notify_all();
    Settle(lock);
  }
  executor_->StopAll();
  {
    const Lock lock(mutex_);
    background_ends_ = true;
    deferred_changed_.notify_all();
  }
  for (std::thread& thread : background_) thread.join();
  background_.clear();
  store_->Stop();
}

}  // namespace weft
