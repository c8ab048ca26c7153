// JobQueue: what it tells of its jobs.
#include <utility>

#include "base/status_macros.h"
#include "services/server/daemon/work/job_queue.h"

namespace weft {

absl::StatusOr<v1::Job> JobQueue::Get(const std::string& job_id) {
  if (std::optional<v1::Job> job = published_.Find(job_id)) return *std::move(job);
  const MutexLock still_there(forgetting_);  // or what was forgotten meanwhile would be published
  absl::StatusOr<v1::Job> job = store_->disk().ReadJob(job_id);
  const Lock lock(mutex_);
  if (const JobRef live = table_.Find(job_id)) return live->life.Describe();
  if (job.ok()) published_.Publish(*job);
  return job;
}

absl::StatusOr<std::vector<v1::FrameInfo>> JobQueue::Frames(const std::string& job_id) {
  {
    const Lock lock(mutex_);
    if (const JobRef job = table_.Find(job_id)) return job->infos();
  }
  WEFT_RETURN_IF_ERROR(store_->disk().ReadJob(job_id).status());
  return store_->disk().ReadFrames(job_id);
}

absl::StatusOr<std::vector<v1::Job>> JobQueue::List(int limit, const std::string& older_than) {
  WEFT_ASSIGN_OR_RETURN(std::vector<v1::Job> jobs, store_->disk().ListJobs(limit, older_than));
  // One that ended since it was read is as it ended.
  for (v1::Job& job : jobs) {
    if (std::optional<v1::Job> newest = published_.Find(job.id())) job = *std::move(newest);
  }
  return jobs;
}

std::vector<std::string> JobQueue::Warnings() {
  std::vector<std::string> warnings = store_->Warnings();
  warnings.insert(warnings.end(), options_.warnings.begin(), options_.warnings.end());
  return warnings;
}

std::vector<v1::Job> JobQueue::Unfinished() {
  const Lock lock(mutex_);
  std::vector<v1::Job> jobs;
  for (const JobRef& job : table_.jobs()) {
    if (!job->ended) jobs.push_back(job->job());
  }
  return jobs;
}

std::optional<v1::Job> JobQueue::FollowerOf(const std::string& take_folder) {
  const Lock lock(mutex_);
  JobRef newest;
  for (const JobRef& job : table_.jobs()) {
    if (job->ended || job->reserved || job->job().spec().live_every() == 0 ||
        job->job().spec().dump() != take_folder)
      continue;
    if (!newest || newest->job().created_unix_ns() < job->job().created_unix_ns()) newest = job;
  }
  if (!newest) return std::nullopt;
  return newest->life.Describe();
}

JobQueue::Load JobQueue::CurrentLoad() {
  Load load;
  load.trouble = store_->Trouble();
  const Lock lock(mutex_);
  for (const JobRef& job : table_.jobs()) {
    if (job->ended) continue;
    ++(job->job().state() == v1::JOB_STATE_RUNNING ? load.running : load.queued);
  }
  load.watchers = static_cast<int>(watchers_.size());
  load.frames_done = table_.frames_done();
  load.frames_failed = table_.frames_failed();
  return load;
}

absl::StatusOr<int64_t> JobQueue::Subscribe(const std::string& job_id, std::function<void()> changed) {
  Lock lock(mutex_);
  WEFT_RETURN_IF_ERROR(watchers_.CheckRoom());
  JobRef job = table_.Find(job_id);
  if (job == nullptr) {
    lock.unlock();
    WEFT_ASSIGN_OR_RETURN(v1::Job read, store_->disk().ReadJob(job_id));
    WEFT_ASSIGN_OR_RETURN(std::vector<v1::FrameInfo> frames, store_->disk().ReadFrames(job_id));
    lock.lock();
    job = table_.Find(job_id);
    if (job == nullptr) job = table_.AddEnded(JobLife(std::move(read), std::move(frames)));
  }
  return watchers_.Add(job, std::move(changed));
}

void JobQueue::Unsubscribe(int64_t watcher) {
  const Lock lock(mutex_);
  if (const JobRef job = watchers_.Remove(watcher)) ForgetIfUnwatched(job);
}

JobQueue::Updates JobQueue::PollUpdates(int64_t watcher) {
  const Lock lock(mutex_);
  return {watchers_.Poll(watcher), table_.stopping()};
}

JobQueue::DrainState JobQueue::CurrentDrain() {
  const Lock lock(mutex_);
  return table_.CurrentDrain();
}

}  // namespace weft
