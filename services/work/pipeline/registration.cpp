#include "services/work/pipeline/registration.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "services/work/pipeline/frame_resume.h"
#include "services/work/pipeline/refine_frame.h"
#include "services/work/pipeline/register_frame.h"

namespace weft {
namespace {

// Passes on the progress of one frame: one call at a time, never backwards.
class AdvancedOnce {
 public:
  AdvancedOnce(const RegistrationEvents& events, std::string frame)
      : events_(events), frame_(std::move(frame)) {}

  void operator()(double share) {
    const MutexLock lock(mutex_);
    if (share <= last_ || !events_.advanced) return;
    last_ = share;
    events_.advanced(frame_, share);
  }

 private:
  const RegistrationEvents& events_;
  const std::string frame_;
  Mutex mutex_;
  double last_ ABSL_GUARDED_BY(mutex_) = 0;
};

// Frames that start from their own results would differ from run to run.
absl::Status CheckStarts(const std::string& starts, const std::string& out) {
  std::error_code error;
  if (starts.empty() || !std::filesystem::equivalent(starts, out, error)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("options.starts: ", starts, " is the folder of the results; give that of an earlier run"));
}

v1::FrameInfo Finished(const v1::FrameReport& report, const CachedStages& standing) {
  v1::FrameInfo info = SummaryOf(report, /*reused=*/!standing.redo);
  if (!standing.redo || standing.why.empty()) return info;
  info.set_redone_from(StageName(*standing.redo));
  info.set_redone_because(standing.why);
  return info;
}

}  // namespace

absl::Status RegisterFrames(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames,
                            const std::vector<size_t>& frames, const v1::RegistrationOptions& asked,
                            const std::string& out, const RegistrationLimits& limits,
                            const RegistrationEvents& events, std::stop_token stop) {
  WEFT_ASSIGN_OR_RETURN(JobOptions options, MakeJobOptions(asked));
  options.kept_image_bytes = static_cast<size_t>(limits.kept_image_mib) << 20;
  WEFT_RETURN_IF_ERROR(CheckStarts(asked.starts(), out));
  const int concurrency = limits.threads > 0 ? limits.threads : tbb::info::default_concurrency();
  // More threads than cores are wanted where a caller asks for them, for example to compare results.
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<size_t>(std::max(concurrency, 1)));
  tbb::task_arena arena(concurrency);
  const FrameSteps steps = StepsOf(inputs, job_frames);
  const auto refine = [&](size_t index) {
    const auto at = std::ranges::lower_bound(job_frames, index) - job_frames.begin();
    absl::Status status;
    if (asked.frames_alone()) return status;
    arena.execute([&] {
      status = RefineAround(inputs, job_frames, steps, static_cast<size_t>(at), options.pipeline.temporal,
                            out, stop);
    });
    return status;
  };
  for (const size_t index : frames) {
    if (stop.stop_requested()) return absl::CancelledError("the registration was cancelled");
    const std::string& name = inputs.dump->frame_names()[index];
    if (events.started) events.started(name);
    const CachedStages standing = InspectFrame(inputs, index, options, out);
    absl::StatusOr<v1::FrameReport> report = standing.report;
    if (standing.redo) {
      WEFT_RETURN_IF_ERROR(events.reads(index));
      AdvancedOnce advanced(events, name);
      arena.execute(
          [&] { report = ResumeFrom(standing, inputs, index, options, out, std::ref(advanced), stop); });
      if (!report.ok()) return report.status();
    }
    // Told last: whoever is killed before that refines when it comes back to the frame.
    WEFT_RETURN_IF_ERROR(refine(index));
    if (events.finished) events.finished(Finished(*report, standing));
  }
  return absl::OkStatus();
}

}  // namespace weft
