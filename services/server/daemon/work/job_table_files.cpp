// JobTable: what stands in the folders of jobs and takes.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "capture/take/recorded_take.h"
#include "services/server/daemon/work/job_table.h"
#include "services/work/kinds/work_kind.h"

namespace weft {
namespace {

// Between looks at the ledger, to which the recorder writes several times a second.
constexpr std::chrono::milliseconds kLookPeriod{250};
// A recorder that is alive notes dropped sets, too; then only cameras without triggers are silent for so
// long.
constexpr double kSilent_s = 10;

}  // namespace

void JobTable::OnFolderTaken(const JobRef& job, const absl::Status& status, JobTime now) {
  job->taking_folder = false;
  if (job->life.is_aborted()) return;  // meanwhile; it ends without tasks
  job->has_folder = status.ok();
  if (absl::IsResourceExhausted(status)) {
    WaitForRoom(job, std::string(status.message()), now);
  } else if (!status.ok()) {
    Abort(job, v1::JOB_STATE_FAILED, std::string(status.message()));
  }
}

void JobTable::FinishIfDone(const JobRef& job) {
  if (job->reserved || job->ended || job->checking || job->finishing || job->start_again || job->outcome ||
      HasTasks(*job) || !job->life.frames().AllProcessed())
    return;
  if (job->life.following() && !job->life.is_aborted()) return;
  if (options_.checks_results && !job->checked && !job->life.is_aborted()) {
    job->checking = true;
    effects_.files.emplace_back(job, JobEffects::Files::kCheck);
    return;
  }
  job->finishing = true;
  effects_.files.emplace_back(job, JobEffects::Files::kFinish);
}

void JobTable::OnChecked(const JobRef& job, const absl::StatusOr<std::vector<IncompleteFrame>>& incomplete,
                         JobTime now) {
  job->checking = false;
  if (absl::IsResourceExhausted(incomplete.status())) {
    WaitForRoom(job, std::string(incomplete.status().message()), now);
  } else if (!incomplete.ok()) {
    Abort(job, v1::JOB_STATE_FAILED, std::string(incomplete.status().message()));
  } else if (!job->life.is_aborted() && !incomplete->empty()) {
    for (const IncompleteFrame& frame : *incomplete)
      Log(JobEffects::Level::kWarning,
          absl::StrCat("job ", job->id(), ": frame ", job->infos()[frame.position].frame(),
                       " is registered again: ", frame.why));
    if (const absl::Status status = job->life.DoAgain(*incomplete); !status.ok()) {
      Abort(job, v1::JOB_STATE_FAILED, std::string(status.message()));
    } else {
      for (const IncompleteFrame& frame : *incomplete) ChangeFrame(job, frame.position);
    }
  } else {
    job->checked = job->life.frames().AllProcessed();
  }
  FinishIfDone(job);
}

void JobTable::OnFinished(const JobRef& job, v1::Job outcome, const absl::Status& status, JobTime now) {
  if (absl::IsResourceExhausted(status) && !stopping_) {
    job->finishing = false;
    return WaitForRoom(job, std::string(status.message()), now);
  }
  if (!status.ok()) outcome.add_warnings(EscapedText(std::string(status.message())));
  Log(JobEffects::Level::kInfo,
      absl::StrCat("job ", outcome.id(), ": ", v1::JobState_Name(outcome.state()), " ", outcome.message()));
  job->outcome = std::move(outcome);
  effects_.concluded.push_back(job);
}

void JobTable::OnTakeSeen(const JobRef& job, bool is_settled,
                          const absl::StatusOr<const TakeProgress*>& progress, int64_t host_time_ns,
                          JobTime now) {
  if (job->ended || job->life.is_aborted() || stopping_) return;
  job->take_settled = is_settled;
  if (!is_settled) {
    if (job->job().message().empty()) {
      job->life.SetMessage("waits until its take, whose recorder died, is recovered");
      ++job->version;
      Show(job);
    }
    job->look_at = now + kLookPeriod;
  } else if (progress.ok()) {
    AddFrames(job, **progress, host_time_ns, now);
    FinishIfDone(job);
  } else {
    Abort(job, v1::JOB_STATE_FAILED, std::string(progress.status().message()));
  }
}

void JobTable::AddFrames(const JobRef& job, const TakeProgress& progress, int64_t host_time_ns, JobTime now) {
  const size_t before = job->infos().size();
  std::vector<std::string> names;
  for (size_t i = before; i < progress.sets.size(); ++i)
    names.push_back(FrameNameOf(progress.sets[i].number));
  job->recorded_ns.resize(std::min(job->recorded_ns.size(), progress.sets.size()));
  for (size_t i = job->recorded_ns.size(); i < progress.sets.size(); ++i)
    job->recorded_ns.push_back(progress.sets[i].host_time_ns);
  if (!names.empty()) {
    job->life.Append(names);
    for (size_t position = before; position < job->infos().size(); ++position) ChangeFrame(job, position);
    job->life.SetMessage("");
    ++job->version;
  }
  job->take_closed = progress.closed;
  if (progress.closed) {
    job->life.HoldFrames();
    return StopFollowingIfIdle(job);
  }
  const double silent_s = progress.sets.empty()
                              ? 0
                              : static_cast<double>(host_time_ns - progress.sets.back().host_time_ns) * 1e-9;
  if (silent_s > kSilent_s && job->job().message().empty()) {
    job->life.SetMessage(absl::StrCat("no frame set came for ", kSilent_s,
                                      " s and the take is not closed; if its recorder has ended, `weft take "
                                      "recover ",
                                      job->job().spec().dump(), "` closes it"));
    ++job->version;
    Show(job);
  }
  job->look_at = now + kLookPeriod;
}

void JobTable::StopFollowingIfIdle(const JobRef& job) {
  if (!job->life.following() || !job->take_closed || job->life.is_aborted() || HasTasks(*job)) return;
  job->life.StopFollowing(KindOf(job->job().spec()).is_refined_later());
  Log(JobEffects::Level::kInfo,
      absl::StrCat("job ", job->id(), ": its take has ended with ", job->infos().size(), " frame sets"));
  ChangeAll(job);
}

}  // namespace weft
