// JobQueue: what stands in the folder of a job, and its end.
#include <spdlog/spdlog.h>

#include "capture/file/plain_text.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/job_queue_state.h"

namespace weft {
namespace {

// A daemon that was killed lets go a moment later.
constexpr std::chrono::milliseconds kLockTimeout{200};

}  // namespace

// Takes the lock of its folder, or ends the job; where the disk has no room the job waits.
bool JobQueue::HoldsFolder(const std::shared_ptr<LiveJob>& job) {
  const absl::Status status = job->folder.Take(kLockTimeout);
  if (absl::IsResourceExhausted(status)) {
    WaitForRoom(*job, std::string(status.message()));
  } else if (!status.ok()) {
    Abort(job, v1::JOB_STATE_FAILED, std::string(status.message()));
  }
  return status.ok();
}

void JobQueue::FinishIfDone(const std::shared_ptr<LiveJob>& job) {
  if (job->ended || job->checking || job->finishing || job->start_again || HasTasks(*job) ||
      !job->life.frames().AllProcessed())
    return;
  if (job->life.following() && !job->life.is_aborted()) return;
  if (options_.find_incomplete && !job->checked && !job->life.is_aborted()) {
    job->checking = true;
    Defer(job, [this, job] { CheckResults(job); });
    return;
  }
  job->finishing = true;
  Defer(job, [this, job] { WriteResults(job); });
}

// In the background: looks at the results of a job that has no tasks.
void JobQueue::CheckResults(const std::shared_ptr<LiveJob>& live) {
  v1::Job job;
  std::vector<v1::FrameInfo> frames;
  {
    const Lock lock(mutex_);
    job = live->job();
    frames = live->infos();
  }
  const auto incomplete = live->folder.Check(job, frames, options_.find_incomplete);
  Lock lock(mutex_);
  live->checking = false;
  if (absl::IsResourceExhausted(incomplete.status())) {
    WaitForRoom(*live, std::string(incomplete.status().message()));
  } else if (!incomplete.ok()) {
    Abort(live, v1::JOB_STATE_FAILED, std::string(incomplete.status().message()));
  } else if (!live->life.is_aborted() && !incomplete->empty()) {
    RegisterAgain(live, *incomplete);
  } else {
    live->checked = live->life.frames().AllProcessed();
  }
  FinishIfDone(live);
  Schedule();
  UnlockAndTell(lock);
}

void JobQueue::RegisterAgain(const std::shared_ptr<LiveJob>& job,
                             const std::vector<IncompleteFrame>& frames) {
  for (const IncompleteFrame& frame : frames) {
    spdlog::warn("job {}: frame {} is registered again: {}", job->job().id(),
                 job->infos()[frame.position].frame(), frame.why);
  }
  if (const absl::Status status = job->life.DoAgain(frames); !status.ok()) {
    Abort(job, v1::JOB_STATE_FAILED, std::string(status.message()));
    return;
  }
  for (const IncompleteFrame& frame : frames) Persist(*job, frame.position);
}

// Watchers are told of the end when job.json and report.html can be fetched.
void JobQueue::WriteResults(const std::shared_ptr<LiveJob>& live) {
  // All frames are dealt with, so that nobody changes them any more.
  const std::vector<size_t> bridged = live->folder.BridgedFrames(live->infos());
  v1::Job job;
  {
    const Lock lock(mutex_);
    job = live->life.Outcome(bridged);
  }
  absl::Status written = live->folder.Finish(live->infos(), options_.endings, job);
  if (written.ok()) written = options_.on_end(job);
  Lock lock(mutex_);
  if (absl::IsResourceExhausted(written) && !stopping_) {
    live->finishing = false;
    WaitForRoom(*live, std::string(written.message()));
    return UnlockAndTell(lock);
  }
  live->folder.LetGo();
  if (!written.ok()) job.add_warnings(EscapedText(std::string(written.message())));
  spdlog::info("job {}: {} {}", job.id(), v1::JobState_Name(job.state()), job.message());
  Conclude(live, std::move(job));
  UnlockAndTell(lock);
}

}  // namespace weft
