// JobQueue: jobs that follow a take while it is being recorded.
#include <spdlog/spdlog.h>

#include <string>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "capture/take/recorded_take.h"
#include "capture/take/take_progress.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/job_queue_state.h"
#include "services/work/kinds/work_kind.h"

namespace weft {
namespace {

// Between looks at the ledger, to which the recorder writes several times a second.
constexpr std::chrono::milliseconds kLookPeriod{250};
// A recorder that is alive notes dropped sets, too; then only cameras without triggers are silent for so
// long.
constexpr double kSilent_s = 10;

}  // namespace

void JobQueue::FollowSoon(LiveJob& job) {
  if (job.life.following()) WakeAt(job.look_at, std::chrono::steady_clock::now());
}

// In the background, without the lock.
void JobQueue::LookAtTake(const std::shared_ptr<LiveJob>& live) {
  const std::string take = live->job().spec().dump();
  const bool settled = options_.is_settled(take);
  if (!live->take) live->take = std::make_unique<TakeFollower>(take);
  const absl::StatusOr<const TakeProgress*> progress = live->take->Look();
  Lock lock(mutex_);
  if (live->ended || live->life.is_aborted() || stopping_) return;
  live->take_settled = settled;
  if (!settled) {
    if (live->job().message().empty()) {
      live->life.SetMessage("waits until its take, whose recorder died, is recovered");
      ++live->version;
      MarkChanged(*live);
    }
    WakeAt(live->look_at, std::chrono::steady_clock::now() + kLookPeriod);
  } else if (progress.ok()) {
    AddFrames(live, **progress);
    FinishIfDone(live);
  } else {
    Abort(live, v1::JOB_STATE_FAILED, std::string(progress.status().message()));
  }
  Schedule();
  UnlockAndTell(lock);
}

void JobQueue::AddFrames(const std::shared_ptr<LiveJob>& live, const TakeProgress& progress) {
  const size_t before = live->infos().size();
  std::vector<std::string> names;
  for (size_t i = before; i < progress.sets.size(); ++i)
    names.push_back(FrameNameOf(progress.sets[i].number));
  live->recorded_ns.resize(std::min(live->recorded_ns.size(), progress.sets.size()));
  for (size_t i = live->recorded_ns.size(); i < progress.sets.size(); ++i)
    live->recorded_ns.push_back(progress.sets[i].host_time_ns);
  if (!names.empty()) {
    live->life.Append(names);
    const std::vector<v1::FrameInfo> added(live->infos().begin() + static_cast<std::ptrdiff_t>(before),
                                           live->infos().end());
    if (!live->unsaved) NoteSaved(*live, catalogue_->AddFrames(live->job().id(), before, added));
    live->life.SetMessage("");
    ++live->version;
    MarkChanged(*live);
  }
  live->take_closed = progress.closed;
  if (progress.closed) {
    live->life.HoldFrames();
    return StopFollowingIfIdle(live);
  }
  const double silent_s = progress.sets.empty()
                              ? 0
                              : static_cast<double>(HostTime_ns() - progress.sets.back().host_time_ns) * 1e-9;
  if (silent_s > kSilent_s && live->job().message().empty()) {
    live->life.SetMessage(absl::StrCat("no frame set came for ", kSilent_s,
                                       " s and the take is not closed; if its "
                                       "recorder has ended, `weft take recover ",
                                       live->job().spec().dump(), "` closes it"));
    ++live->version;
    MarkChanged(*live);
  }
  WakeAt(live->look_at, std::chrono::steady_clock::now() + kLookPeriod);
}

void JobQueue::StopFollowingIfIdle(const std::shared_ptr<LiveJob>& live) {
  if (!live->life.following() || !live->take_closed || live->life.is_aborted() || HasTasks(*live)) return;
  live->life.StopFollowing(KindOf(live->job().spec()).is_refined_later());
  spdlog::info("job {}: its take has ended with {} frame sets", live->job().id(), live->infos().size());
  ++live->version;
  SaveAll(*live);
  MarkChanged(*live);
}

void JobQueue::NoteLatency(LiveJob& job, size_t position) {
  if (!job.life.following() || position >= job.recorded_ns.size()) return;
  job.life.SetLatency(position, static_cast<double>(HostTime_ns() - job.recorded_ns[position]) * 1e-9);
  ++job.version;
}

}  // namespace weft
