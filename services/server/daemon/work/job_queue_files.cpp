// JobQueue: files of jobs, read and written in the background.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "base/host_clock.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/work/pipeline/frame_files.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {
namespace {

// A daemon that was killed lets go a moment later.
constexpr std::chrono::milliseconds kLockTimeout{200};

// The frame's own report, since no worker is left to write it.
absl::Status WriteQuarantineReport(const v1::Job& job, const v1::FrameInfo& info) {
  v1::FrameReport report;
  report.set_frame(info.frame());
  report.set_state(info.state());
  report.set_reason(info.reason());
  report.set_set_aside(true);
  *report.mutable_inputs() = job.inputs();
  *report.mutable_options() = job.spec().options();
  *report.mutable_keys() = KeysOf(job.inputs(), job.spec().options());
  report.set_weft_version(WEFT_VERSION);
  return WriteReportAlone(job.spec().out(), report);
}

}  // namespace

void JobQueue::DeferReport(const JobEffects::Quarantined& frame) {
  deferred_.push_back({frame.job, Lane::kResults, [job = frame.job->job(), info = frame.frame] {
                         const absl::Status status = WriteQuarantineReport(job, info);
                         if (!status.ok()) spdlog::error("{}", std::string(status.message()));
                       }});
  deferred_changed_.notify_all();
}

void JobQueue::Defer(const JobRef& job, FilesWork what) {
  const auto found = files_.find(job);
  if (found == files_.end()) return;
  const std::shared_ptr<JobFiles> files = found->second;  // the job may end before its turn comes
  const auto work = [&]() -> std::function<void()> {
    switch (what) {
      case FilesWork::kTakeFolder:
        return [this, job, files] { TakeFolder(job, *files); };
      case FilesWork::kCheck:
        return [this, job, files] { CheckResults(job, *files); };
      case FilesWork::kFinish:
        return [this, job, files] { WriteResults(job, *files); };
      default:
        return [this, job, files] { PollTake(job, *files); };
    }
  };
  const Lane lane = what == FilesWork::kTakeFolder ? Lane::kFolders : Lane::kResults;
  deferred_.push_back({job, lane, work()});
  deferred_changed_.notify_all();
}

void JobQueue::TakeFolder(const JobRef& job, JobFiles& files) {
  const absl::Status taken = files.folder.Take(kLockTimeout);
  Lock lock(mutex_);
  table_.OnFolderTaken(job, taken, std::chrono::steady_clock::now());
  Settle(lock);
}

void JobQueue::CheckResults(const JobRef& job, JobFiles& files) {
  v1::Job now;
  std::vector<v1::FrameInfo> frames;
  {
    const Lock lock(mutex_);
    now = job->job();
    frames = job->infos();
  }
  const auto incomplete = files.folder.Check(now, frames, options_.find_incomplete);
  Lock lock(mutex_);
  table_.OnChecked(job, incomplete, std::chrono::steady_clock::now());
  Settle(lock);
}

// Those who watch are told of the end when job.json and report.html can be fetched.
void JobQueue::WriteResults(const JobRef& job, JobFiles& files) {
  // All frames are dealt with, so that nobody changes them any more.
  const std::vector<size_t> bridged = files.folder.BridgedFrames(job->infos());
  v1::Job outcome;
  {
    const Lock lock(mutex_);
    outcome = table_.Outcome(job, bridged);
  }
  absl::Status written = files.folder.Finish(job->infos(), options_.endings, outcome);
  if (written.ok()) written = options_.on_end(outcome);
  if (!absl::IsResourceExhausted(written)) files.folder.LetGo();  // otherwise it comes back
  Lock lock(mutex_);
  table_.OnFinished(job, std::move(outcome), written, std::chrono::steady_clock::now());
  Settle(lock);
}

void JobQueue::PollTake(const JobRef& job, JobFiles& files) {
  const std::string take = job->job().spec().dump();
  const bool settled = options_.is_settled(take);
  if (!files.take) files.take = std::make_unique<TakeFollower>(take);
  const absl::StatusOr<const TakeProgress*> progress = files.take->Poll();
  Lock lock(mutex_);
  table_.OnTakeSeen(job, settled, progress, HostTime_ns(), std::chrono::steady_clock::now());
  Settle(lock);
}

// Results that are slow to read keep one thread of their caller's, or two; the others' jobs end meanwhile.
std::optional<JobQueue::Deferred> JobQueue::NextDeferred(Lane lane) {
  constexpr int kOfOneCaller = 2;
  std::set<JobRef> seen;
  std::vector<std::list<Deferred>::iterator> may_begin;
  std::vector<std::string> callers;
  for (auto at = deferred_.begin(); at != deferred_.end(); ++at) {
    if (!seen.insert(at->job).second || in_background_.contains(at->job) || at->lane != lane) continue;
    if (lane == Lane::kResults && background_turns_.Running(at->job->caller()) >= kOfOneCaller) continue;
    may_begin.push_back(at);
    callers.push_back(at->job->caller());
  }
  if (may_begin.empty()) return std::nullopt;
  const auto next = may_begin[lane == Lane::kResults ? background_turns_.Next(callers) : 0];
  Deferred deferred = std::move(*next);
  deferred_.erase(next);
  return deferred;
}

void JobQueue::WorkInBackground(Lane lane) {
  Lock lock(mutex_);
  for (;;) {
    if (std::optional<Deferred> next = NextDeferred(lane)) {
      const std::string caller = next->job->caller();
      const JobTime began = std::chrono::steady_clock::now();
      in_background_.insert(next->job);
      if (lane == Lane::kResults) background_turns_.Begin(caller);
      lock.unlock();
      next->work();
      lock.lock();
      if (lane == Lane::kResults) {
        const std::chrono::duration<double> lasted = std::chrono::steady_clock::now() - began;
        background_turns_.End(caller, lasted.count());
      }
      in_background_.erase(next->job);
      deferred_changed_.notify_all();
      continue;
    }
    if (background_ends_ && deferred_.empty() && in_background_.empty()) return;
    // One thread looks at the clock.
    const std::optional<JobTime> due = lane == Lane::kFolders ? table_.NextDue() : std::nullopt;
    if (due && *due <= std::chrono::steady_clock::now()) {
      table_.DoWhatIsDue(std::chrono::steady_clock::now());
      Settle(lock);
      lock.lock();
    } else if (due) {
      deferred_changed_.wait_until(lock, *due);
    } else {
      deferred_changed_.wait(lock);
    }
  }
}

}  // namespace weft
