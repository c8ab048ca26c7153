// JobQueue: what stands in the folder of a job, and its end.
#include <spdlog/spdlog.h>

#include <exception>

#include "absl/strings/str_cat.h"
#include "capture/plain_text.h"
#include "services/daemon/job_queue.h"
#include "services/daemon/job_queue_state.h"
#include "services/files/atomic_file.h"
#include "services/files/confined_folder.h"
#include "services/files/json_file.h"
#include "services/pipeline/frame_files.h"
#include "services/pipeline/refine_frame.h"

namespace weft {
namespace {

std::string FirstFailure(const JobFrames& frames) {
  for (const v1::FrameInfo& info : frames.infos()) {
    if (info.state() == v1::FRAME_STATE_FAILED)
      return absl::StrCat("frame ", info.frame(), ": ", info.reason());
  }
  return "";
}

// job.json and the report. What a report's writer throws costs the report, not the daemon.
absl::Status WriteJobFiles(const v1::Job& job, const JobQueueOptions& options) {
  const std::string& out = job.spec().out();
  if (absl::Status status = CreateFolders(out); !status.ok()) return status;
  const absl::StatusOr<ConfinedFolder> folder = ConfinedFolder::Open(out);
  if (!folder.ok()) return folder.status();
  if (absl::Status status = folder->InWords(WriteJsonFile(folder->At("job.json"), job)); !status.ok()) {
    return status;
  }
  if (!options.write_report) return absl::OkStatus();
  try {
    return options.write_report(out, job);
  } catch (const std::exception& error) {
    return absl::InternalError(absl::StrCat("the report cannot be written: ", error.what()));
  }
}

// What a judge throws costs the verdict, not the daemon.
void Judge(const JobQueueOptions& options, v1::Job& job) {
  if (!options.judge) return;
  try {
    *job.mutable_verdict() = options.judge(job.spec().out(), job);
  } catch (const std::exception& error) {
    job.add_warnings(absl::StrCat("the job cannot be judged: ", error.what()));
  }
}

// Positions of the failed frames that have a mesh from the frames around them.
std::vector<size_t> BridgedFrames(const std::string& out, const std::vector<v1::FrameInfo>& infos) {
  std::vector<size_t> bridged;
  for (size_t i = 0; i < infos.size(); ++i) {
    if (infos[i].state() == v1::FRAME_STATE_FAILED && WasBridged(out, infos[i].frame())) bridged.push_back(i);
  }
  return bridged;
}

std::vector<std::string> NamesOf(const std::vector<v1::FrameInfo>& frames) {
  std::vector<std::string> names;
  for (const v1::FrameInfo& info : frames) names.push_back(info.frame());
  return names;
}

// Makes the folder where it is missing, and takes its lock where `lock` does not hold it.
absl::Status TakeFolder(const v1::Job& job, std::optional<ResultLock>& lock) {
  // A daemon that was killed lets go a moment later.
  constexpr std::chrono::milliseconds kPatience{200};
  const std::string& out = job.spec().out();
  if (lock) {
    const absl::Status status = lock->Renew();
    if (!status.ok()) lock.reset();
    return status;
  }
  if (absl::Status status = CreateFolders(out); !status.ok()) return status;
  absl::StatusOr<ResultLock> taken =
      ResultLock::Acquire(out, absl::StrCat("job ", job.id(), " of weftd"), kPatience);
  if (taken.ok()) lock = *std::move(taken);
  return taken.status();
}

}  // namespace

// Takes the lock of its folder, or ends the job; where the disk has no room the job waits.
bool JobQueue::HoldsFolder(const std::shared_ptr<LiveJob>& job) {
  const absl::Status status = TakeFolder(job->job, job->lock);
  if (absl::IsResourceExhausted(status)) {
    WaitForRoom(*job, std::string(status.message()));
  } else if (!status.ok()) {
    EndEarly(job, v1::JOB_STATE_FAILED, std::string(status.message()));
  }
  return status.ok();
}

void JobQueue::FinishIfDone(const std::shared_ptr<LiveJob>& job) {
  if (job->ended || job->checking || job->finishing || job->start_again || HasTasks(*job) ||
      !job->frames.AllDealtWith())
    return;
  if (options_.find_incomplete && !job->checked && !job->early) {
    job->checking = true;
    Defer([this, job] { CheckResults(job); });
    return;
  }
  job->finishing = true;
  Defer([this, job] { WriteResults(job); });
}

// In the background: looks at the results of a job that has no tasks.
void JobQueue::CheckResults(const std::shared_ptr<LiveJob>& live) {
  v1::Job job;
  std::vector<v1::FrameInfo> frames;
  {
    const Lock lock(mutex_);
    job = live->job;
    frames = live->frames.infos();
  }
  absl::StatusOr<std::vector<IncompleteFrame>> incomplete = std::vector<IncompleteFrame>();
  if (absl::Status status = TakeFolder(job, live->lock); status.ok()) {
    RemoveTemporaryFiles(job.spec().out(), NamesOf(frames));
    incomplete = options_.find_incomplete(job, frames);
  } else {
    incomplete = status;
  }
  Lock lock(mutex_);
  live->checking = false;
  if (absl::IsResourceExhausted(incomplete.status())) {
    WaitForRoom(*live, std::string(incomplete.status().message()));
  } else if (!incomplete.ok()) {
    EndEarly(live, v1::JOB_STATE_FAILED, std::string(incomplete.status().message()));
  } else if (!live->early && !incomplete->empty()) {
    RegisterAgain(live, *incomplete);
  } else {
    live->checked = live->frames.AllDealtWith();
  }
  FinishIfDone(live);
  Schedule();
  UnlockAndTell(lock);
}

void JobQueue::RegisterAgain(const std::shared_ptr<LiveJob>& job,
                             const std::vector<IncompleteFrame>& frames) {
  for (const IncompleteFrame& frame : frames) {
    const std::string name = job->frames.infos()[frame.position].frame();
    spdlog::warn("job {}: frame {} is registered again: {}", job->job.id(), name, frame.why);
    if (job->repairs == kMaxRepairs) {
      const absl::Status status = TooManyRepairs(job->job.spec().out(), name, frame.why);
      EndEarly(job, v1::JOB_STATE_FAILED, std::string(status.message()));
      return;
    }
    job->frames.DoAgain(frame.position);
    Remember(*job, frame.position);
  }
  ++job->repairs;
}

// Watchers are told of the end when job.json and report.html can be fetched.
void JobQueue::WriteResults(const std::shared_ptr<LiveJob>& live) {
  v1::Job job;
  // All frames are dealt with, so that nobody changes them any more.
  const std::vector<size_t> bridged = BridgedFrames(live->job.spec().out(), live->frames.infos());
  {
    const Lock lock(mutex_);
    for (const size_t position : bridged) live->frames.Bridge(position);
    job = Describe(*live);
    const v1::FrameCounts& frames = job.frames();
    job.set_state(v1::JOB_STATE_DONE);
    job.set_message("");
    if (live->early) {
      job.set_state(live->early->state);
      job.set_message(live->early->message);
    } else if (frames.done() + frames.degraded() == 0) {
      job.set_state(v1::JOB_STATE_FAILED);
      job.set_message(absl::StrCat("no frame could be registered; ", FirstFailure(live->frames)));
    }
    job.set_finished_unix_ns(UnixNow());
    job.set_remaining_s(0);
  }
  absl::Status written = TakeFolder(job, live->lock);
  if (written.ok()) {
    Judge(options_, job);
    RemoveTemporaryFiles(job.spec().out(), NamesOf(live->frames.infos()));
    written = WriteJobFiles(job, options_);
  }
  Lock lock(mutex_);
  if (absl::IsResourceExhausted(written) && !stopping_) {
    live->finishing = false;
    WaitForRoom(*live, std::string(written.message()));
    return UnlockAndTell(lock);
  }
  live->lock.reset();
  if (!written.ok()) job.add_warnings(EscapedText(std::string(written.message())));
  spdlog::info("job {}: {} {}", job.id(), v1::JobState_Name(job.state()), job.message());
  Conclude(live, std::move(job));
  UnlockAndTell(lock);
}

}  // namespace weft
