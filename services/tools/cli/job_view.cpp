#include "services/tools/cli/job_view.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/files/enum_words.h"
#include "services/formats/verdict/verdict.h"
#include "services/work/kinds/work_kind.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {
namespace {

// Steps of the bar: thousandths of the job.
constexpr uint64_t kSteps = 1000;

const char* StateWord(const v1::FrameInfo& info) {
  const bool is_bridged = info.state() == v1::FRAME_STATE_FAILED && info.bridged();
  return is_bridged ? "bridged" : EnumWord(info.state(), "unknown");
}

int Finished(const v1::FrameCounts& frames) {
  return frames.done() + frames.degraded() + frames.failed() + frames.cancelled();
}

}  // namespace

const char* JobStateWord(v1::JobState state) { return EnumWord(state, "unknown"); }

std::string FrameLine(const v1::FrameInfo& info, bool has_coverage) {
  std::string line = absl::StrFormat("%-6s  %-9s", info.frame(), StateWord(info));
  if (info.state() == v1::FRAME_STATE_DONE || info.state() == v1::FRAME_STATE_DEGRADED) {
    if (has_coverage) absl::StrAppendFormat(&line, "  %5.1f %% of the cells", 100 * info.coverage());
    if (info.reused()) {
      absl::StrAppend(&line, "  kept from an earlier run");
    } else {
      absl::StrAppendFormat(&line, "  %6.1f s", info.total_ms() / 1000);
    }
  }
  if (info.latency_s() > 0) absl::StrAppendFormat(&line, "  %.1f s after its recording", info.latency_s());
  if (!info.reason().empty()) absl::StrAppend(&line, "  (", info.reason(), ")");
  return line;
}

std::string JobText(const v1::Job& job) {
  const v1::FrameCounts& frames = job.frames();
  std::string summary =
      absl::StrCat(frames.done() + frames.degraded(), " of ", frames.total(),
                   frames.total() == 1 ? " frame " : " frames ", KindOf(job.spec()).done_word());
  if (frames.degraded() > 0) absl::StrAppend(&summary, " (", frames.degraded(), " with cameras missing)");
  if (frames.reused() > 0) absl::StrAppend(&summary, ", ", frames.reused(), " kept from an earlier run");
  if (frames.bridged() > 0) absl::StrAppend(&summary, ", ", frames.bridged(), " bridged");
  if (const int left = frames.failed() - frames.bridged(); left > 0) {
    absl::StrAppend(&summary, ", ", left, " failed");
  }
  if (frames.cancelled() > 0) absl::StrAppend(&summary, ", ", frames.cancelled(), " cancelled");
  if (job.state() == v1::JOB_STATE_RUNNING && job.live().following()) {
    absl::StrAppendFormat(&summary, "; live, %d behind, the newest %.1f s after its recording",
                          job.live().backlog(), job.live().latency_s());
  }
  return summary;
}

absl::Status OutcomeOf(const v1::Job& job) {
  if (job.state() == v1::JOB_STATE_CANCELLED) {
    return absl::CancelledError(
        absl::StrCat("the job was cancelled: ", JobText(job), "; run the command again to go on"));
  }
  if (job.has_verdict()) return VerdictStatus(job.verdict());
  // Of a job of an earlier version.
  if (job.state() == v1::JOB_STATE_FAILED) return absl::InternalError(job.message());
  if (job.frames().failed() > 0) {
    return absl::InternalError(absl::StrCat(job.frames().failed(), " of ", job.frames().total(),
                                            " frames could not be ", KindOf(job.spec()).done_word(),
                                            "; the reasons are above and in the report"));
  }
  return absl::OkStatus();
}

JobView::JobView(bool quiet, const std::string& label)
    : quiet_(quiet), progress_(label, kSteps, ProgressVisible(quiet), ProgressUnit::kPercent) {}

void JobView::Show(const v1::JobUpdate& update) {
  has_coverage_ = KindOf(update.job().spec()).has_coverage();
  for (const v1::FrameInfo& info : update.frames()) {
    switch (info.state()) {
      case v1::FRAME_STATE_RUNNING:
        share_of_running_[info.frame()] = info.share_done();
        break;
      case v1::FRAME_STATE_DONE:
      case v1::FRAME_STATE_DEGRADED:
      case v1::FRAME_STATE_FAILED:
        Announce(info);
        [[fallthrough]];
      default:
        share_of_running_.erase(info.frame());
    }
  }
  const v1::FrameCounts& frames = update.job().frames();
  if (frames.total() == 0) return;
  double done = Finished(frames);
  for (const auto& [frame, share] : share_of_running_) done += share;
  progress_.Set(static_cast<uint64_t>(done / frames.total() * kSteps), kSteps);
}

void JobView::Announce(const v1::FrameInfo& info) {
  if (!info.redone_from().empty()) {
    const std::string text = RedoneText(info.redone_from(), info.redone_because());
    if (!quiet_ && redone_.insert(text).second) {
      progress_.PrintLine(absl::StrCat("results of an earlier run are ", text));
    }
  }
  if (!quiet_) progress_.PrintLine(FrameLine(info, has_coverage_));
}

}  // namespace weft
