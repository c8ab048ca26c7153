#include "services/server/daemon/work/job_queue.h"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/callers/fair_share.h"
#include "services/server/catalogue/message_text.h"
#include "services/server/daemon/work/job_queue_state.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/retry_after.h"

namespace weft {
namespace {

constexpr int64_t kMostUnfinishedJobs = 1000, kReservedJobs = 50;  // in all; of them for operators
constexpr size_t kMaxWatchers = 4096;
constexpr size_t kMaxFramesPerUpdate = 1000;
constexpr std::chrono::seconds kRetryWhereFull{5};
constexpr std::chrono::seconds kCancelPatience{45};  // less than the client's

// Gives the frames whose entries were damaged their names from the inputs.
absl::Status NameFrames(const JobQueueOptions& options, const v1::Job& job,
                        std::vector<v1::FrameInfo>& infos) {
  const absl::StatusOr<std::vector<std::string>> names =
      options.list_frames ? options.list_frames(job.spec())
                          : absl::StatusOr<std::vector<std::string>>(absl::UnavailableError("no inputs"));
  if (names.ok() && names->size() == infos.size()) {
    for (size_t i = 0; i < infos.size(); ++i) infos[i].set_frame((*names)[i]);
    return absl::OkStatus();
  }
  return absl::DataLossError(
      absl::StrCat("the catalogue's list of its frames was damaged, and its inputs do not give them (",
                   names.ok() ? absl::StrCat("they hold ", names->size(), " frames, it had ", infos.size())
                              : std::string(names.status().message()),
                   "); submit it again: finished frames are kept"));
}

absl::Status ShuttingDown() { return absl::UnavailableError("the daemon is shutting down"); }

}  // namespace

JobQueue::JobQueue(std::unique_ptr<Catalogue> catalogue, std::unique_ptr<Executor> executor,
                   JobQueueOptions options)
    : catalogue_(std::move(catalogue)), executor_(std::move(executor)), options_(std::move(options)) {}

absl::StatusOr<std::unique_ptr<JobQueue>> JobQueue::Create(std::unique_ptr<Catalogue> catalogue,
                                                           std::unique_ptr<Executor> executor,
                                                           JobQueueOptions options) {
  std::unique_ptr<JobQueue> queue(
      new JobQueue(std::move(catalogue), std::move(executor), std::move(options)));
  constexpr int kBackgroundThreads = 3;
  for (int i = 0; i < kBackgroundThreads; ++i)
    queue->background_.emplace_back(&JobQueue::WorkInBackground, queue.get(), i == 0);
  WEFT_RETURN_IF_ERROR(queue->Resume());
  return queue;
}

JobQueue::~JobQueue() { Stop(); }

absl::Status JobQueue::Resume() {
  Lock lock(mutex_);
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::Job> unfinished, catalogue_->UnfinishedJobs());
  for (v1::Job& job : unfinished) {
    absl::StatusOr<std::vector<v1::FrameInfo>> infos = catalogue_->ReadFrames(job.id());
    if (infos.ok()) {
      ResumeJob(std::move(job), *std::move(infos));
    } else {
      spdlog::error("job {} cannot be taken up: {}", job.id(), std::string(infos.status().message()));
    }
  }
  executor_->TakeUp([this](const v1::Task& task) { return TakeUpTask(task); });
  PlanBackup();
  Schedule();
  return absl::OkStatus();
}

void JobQueue::ResumeJob(v1::Job job, std::vector<v1::FrameInfo> infos) {
  const bool damaged =
      std::any_of(infos.begin(), infos.end(), [](const v1::FrameInfo& info) { return info.frame().empty(); });
  absl::Status named;
  if (damaged) named = NameFrames(options_, job, infos);
  const auto live = std::make_shared<LiveJob>(JobLife(std::move(job), std::move(infos)));
  Enqueue(live);
  // The daemon's own end is no fault of the frames that ran.
  for (size_t i = 0; i < live->infos().size(); ++i) {
    if (live->infos()[i].state() != v1::FRAME_STATE_RUNNING) continue;
    live->life.frames().Requeue(i, JobFrames::Attempt::kDaemonKilled);
    Persist(*live, i);
  }
  if (live->life.is_aborted()) live->life.CancelWaiting([](size_t) { return false; });
  if (damaged && named.ok()) SaveAll(*live);
  spdlog::info("job {} is resumed: {} frames left", live->job().id(), live->life.frames().FramesLeft());
  if (!named.ok()) Abort(live, v1::JOB_STATE_FAILED, std::string(named.message()));
  const v1::FrameCounts counts = live->life.frames().Counts();
  FollowSoon(*live);
  // While it follows a take, its frames are registered by themselves, which is not what its results will be.
  if (options_.find_incomplete && !live->life.is_aborted() && !live->life.following() &&
      counts.done() + counts.degraded() + counts.failed() > 0) {
    live->checking = true;
    Defer(live, [this, live] { CheckResults(live); });
  }
  FinishIfDone(live);
}

absl::Status JobQueue::CheckRoom(const v1::Job& job, v1::Role role) const {
  if (stopping_) return ShuttingDown();
  WEFT_RETURN_IF_ERROR(options_.admit());
  FairShare share(
      {.all = kMostUnfinishedJobs, .of_one_caller = options_.max_of_one_caller, .reserve = kReservedJobs},
      "unfinished jobs");
  for (const auto& other : jobs_) {
    if (!other->ended) share.Take(other->caller());
  }
  WEFT_RETURN_IF_ERROR(share.Check({job.submitted_by(), role}));
  for (const auto& other : jobs_) {
    const std::string& out = other->job().spec().out();
    const bool is_theirs = !IsSameAccount(other->caller(), job.submitted_by()) &&
                           absl::StartsWith(job.spec().out(), absl::StrCat(out, "/"));
    if (other->ended || (out != job.spec().out() && !is_theirs)) continue;
    return FieldError(absl::StatusCode::kFailedPrecondition,
                      {"spec.out", absl::StrCat(out, " is where job ", other->job().id(), " writes"),
                       "wait until it has ended, or cancel it"});
  }
  return absl::OkStatus();
}

absl::Status JobQueue::Submit(v1::Job job, const std::vector<std::string>& frames, v1::Role role) {
  Lock lock(mutex_);
  WEFT_RETURN_IF_ERROR(CheckRoom(job, role));
  for (const std::string& frame : frames) {
    if (IsUtf8(frame)) continue;
    return absl::InvalidArgumentError(absl::StrCat(job.spec().dump(), ": the name of frame ",
                                                   EscapedText(frame), " is not UTF-8 text; rename it"));
  }
  EscapeTexts(job);
  auto live = std::make_shared<LiveJob>(JobLife(std::move(job), frames));
  WEFT_RETURN_IF_ERROR(catalogue_->AddJob(live->job(), live->infos()));
  spdlog::info("job {}: {} frames of {}, results to {}", live->job().id(), frames.size(),
               live->job().spec().dump(), live->job().spec().out());
  Enqueue(live);
  FollowSoon(*live);
  PlanBackup();
  Schedule();
  UnlockAndTell(lock);
  return absl::OkStatus();
}

void JobQueue::Enqueue(const std::shared_ptr<LiveJob>& job) {
  const auto later = std::find_if(jobs_.begin(), jobs_.end(), [&job](const auto& other) {
    return !other->ended && other->job().priority() < job->job().priority();
  });
  jobs_.insert(later, job);
  published_.Publish(job->life.Describe());
}

std::shared_ptr<JobQueue::LiveJob> JobQueue::FindLive(const std::string& job_id) const {
  std::shared_ptr<LiveJob> found;
  for (const auto& job : jobs_) {
    if (job->job().id() != job_id) continue;
    found = job;
    // Those who watched it to its end before it was retried still hold the other one.
    if (!job->ended) break;
  }
  return found;
}

absl::StatusOr<v1::Job> JobQueue::Get(const std::string& job_id) {
  // The lock may be held while the disk writes.
  if (std::optional<v1::Job> job = published_.Find(job_id)) return *std::move(job);
  const Lock lock(mutex_);
  absl::StatusOr<v1::Job> job = catalogue_->ReadJob(job_id);
  if (job.ok()) published_.Publish(*job);
  return job;
}

absl::StatusOr<std::vector<v1::FrameInfo>> JobQueue::Frames(const std::string& job_id) {
  const Lock lock(mutex_);
  if (const auto live = FindLive(job_id)) return live->infos();
  if (const absl::StatusOr<v1::Job> job = catalogue_->ReadJob(job_id); !job.ok()) return job.status();
  return catalogue_->ReadFrames(job_id);
}

absl::StatusOr<std::vector<v1::Job>> JobQueue::List(int limit, const std::string& older_than) {
  const Lock lock(mutex_);
  absl::StatusOr<std::vector<v1::Job>> jobs = catalogue_->ListJobs(limit, older_than);
  if (!jobs.ok()) return jobs;
  for (v1::Job& job : *jobs) {
    if (const auto live = FindLive(job.id())) job = live->life.Describe();
  }
  return jobs;
}

std::vector<std::string> JobQueue::Warnings() {
  const Lock lock(mutex_);
  std::vector<std::string> warnings = catalogue_->warnings();
  warnings.insert(warnings.end(), options_.warnings.begin(), options_.warnings.end());
  for (const std::string* trouble : {&catalogue_trouble_, &backup_trouble_}) {
    if (!trouble->empty()) warnings.push_back(*trouble);
  }
  return warnings;
}

std::vector<v1::Job> JobQueue::Unfinished() {
  const Lock lock(mutex_);
  std::vector<v1::Job> jobs;
  for (const auto& job : jobs_) {
    if (!job->ended) jobs.push_back(job->job());
  }
  return jobs;
}

std::optional<v1::Job> JobQueue::FollowerOf(const std::string& take_folder) {
  const Lock lock(mutex_);
  std::shared_ptr<LiveJob> newest;
  for (const auto& job : jobs_) {
    if (job->ended || job->job().spec().live_every() == 0 || job->job().spec().dump() != take_folder)
      continue;
    if (!newest || newest->job().created_unix_ns() < job->job().created_unix_ns()) newest = job;
  }
  if (!newest) return std::nullopt;
  return newest->life.Describe();
}

JobQueue::Load JobQueue::CurrentLoad() {
  const Lock lock(mutex_);
  Load load;
  for (const auto& job : jobs_) {
    if (job->ended) continue;
    ++(job->job().state() == v1::JOB_STATE_RUNNING ? load.running : load.queued);
  }
  load.watchers = static_cast<int>(watchers_.size());
  load.frames_done = frames_done_;
  load.frames_failed = frames_failed_;
  load.trouble = catalogue_trouble_;
  return load;
}

absl::StatusOr<v1::Job> JobQueue::Cancel(const std::string& job_id) {
  Lock lock(mutex_);
  const auto live = FindLive(job_id);
  if (live == nullptr) return catalogue_->ReadJob(job_id);
  Abort(live, v1::JOB_STATE_CANCELLED, "cancelled");
  UnlockAndTell(lock);
  lock.lock();
  job_ended_.wait_for(lock, kCancelPatience, [&] { return live->ended || stopping_; });
  if (!live->ended && stopping_) return ShuttingDown();
  if (!live->ended) {
    return absl::UnavailableError(absl::StrCat("job ", job_id,
                                               " is being cancelled; its end is not written down yet",
                                               catalogue_trouble_.empty() ? "" : ": ", catalogue_trouble_));
  }
  return live->life.Describe();
}

absl::StatusOr<v1::Job> JobQueue::Retry(const std::string& job_id, v1::Role role) {
  Lock lock(mutex_);
  if (const auto live = FindLive(job_id); live && !live->ended) return live->life.Describe();
  absl::StatusOr<v1::Job> job = catalogue_->ReadJob(job_id);
  if (!job.ok()) return job;
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::FrameInfo> frames, catalogue_->ReadFrames(job_id));
  WEFT_RETURN_IF_ERROR(CheckRoom(*job, role));
  JobLife life(*job, std::move(frames));
  if (!life.Retry()) return job;
  const auto again = std::make_shared<LiveJob>(std::move(life));
  job = again->life.Describe();
  WEFT_RETURN_IF_ERROR(catalogue_->UpdateAll(*job, again->infos()));
  spdlog::info("job {} is retried: {} frames left", job_id, again->life.frames().FramesLeft());
  Enqueue(again);
  FollowSoon(*again);
  PlanBackup();
  Schedule();
  UnlockAndTell(lock);
  return job;
}

absl::StatusOr<v1::Job> JobQueue::SetPriority(const std::string& job_id, int priority) {
  Lock lock(mutex_);
  const auto live = FindLive(job_id);
  if (live == nullptr || live->ended) return catalogue_->ReadJob(job_id);
  live->life.SetPriority(priority);
  jobs_.remove(live);
  // Where it would stand had it been submitted with it.
  const auto later = std::find_if(jobs_.begin(), jobs_.end(), [&](const auto& other) {
    if (other->ended) return false;
    const v1::Job& theirs = other->job();
    return theirs.priority() < priority ||
           (theirs.priority() == priority && theirs.created_unix_ns() > live->job().created_unix_ns());
  });
  jobs_.insert(later, live);
  PersistJob(*live);
  Schedule();
  v1::Job job = live->life.Describe();
  UnlockAndTell(lock);
  return job;
}

absl::StatusOr<int64_t> JobQueue::Subscribe(const std::string& job_id, std::function<void()> changed) {
  const Lock lock(mutex_);
  if (watchers_.size() >= kMaxWatchers) {
    return RetryLater(absl::StatusCode::kResourceExhausted,
                      absl::StrCat(watchers_.size(), " clients watch jobs, the most at once"),
                      kRetryWhereFull);
  }
  auto live = FindLive(job_id);
  if (live == nullptr) {
    WEFT_ASSIGN_OR_RETURN(v1::Job job, catalogue_->ReadJob(job_id));
    WEFT_ASSIGN_OR_RETURN(std::vector<v1::FrameInfo> frames, catalogue_->ReadFrames(job_id));
    live = std::make_shared<LiveJob>(JobLife(std::move(job), std::move(frames)));
    live->ended = true;
    jobs_.push_back(live);
  }
  ++live->watchers;
  const int64_t id = next_watcher_++;
  watchers_[id] = std::make_unique<Watcher>(Watcher{live, std::move(changed)});
  return id;
}

void JobQueue::Unsubscribe(int64_t watcher) {
  const Lock lock(mutex_);
  const auto found = watchers_.find(watcher);
  if (found == watchers_.end()) return;
  const std::shared_ptr<LiveJob> job = found->second->job;
  watchers_.erase(found);
  --job->watchers;
  Forget(job);
}

JobQueue::News JobQueue::PollUpdates(int64_t watcher) {
  const Lock lock(mutex_);
  News news;
  news.stopping = stopping_;
  const auto found = watchers_.find(watcher);
  if (found == watchers_.end() || found->second->told_end) return news;
  Watcher& own = *found->second;
  const LiveJob& job = *own.job;
  const JobFrames::Changes changes = job.life.frames().ChangedSince(own.seen_frames, kMaxFramesPerUpdate);
  if (changes.positions.empty() && own.seen_job == job.version) return news;
  v1::JobUpdate update;
  *update.mutable_job() = job.life.Describe();
  for (const size_t position : changes.positions) *update.add_frames() = job.infos()[position];
  own.seen_frames = changes.up_to;
  own.seen_job = job.version;
  own.told_end = news.ended = job.ended && changes.up_to == job.life.frames().version();
  news.update = std::move(update);
  return news;
}

void JobQueue::Stop() {
  {
    Lock lock(mutex_);
    stopping_ = true;
    for (const auto& [id, watcher] : watchers_) to_tell_.push_back(watcher->changed);
    job_ended_.notify_all();
    UnlockAndTell(lock);
  }
  executor_->StopAll();
  {
    const Lock lock(mutex_);
    background_ends_ = true;
    deferred_changed_.notify_all();
  }
  for (std::thread& thread : background_) thread.join();
  background_.clear();
}

}  // namespace weft
