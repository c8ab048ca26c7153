#include "services/work/kinds/local_job.h"

#include <chrono>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "services/results/report/job_report.h"
#include "services/results/report/job_verdict.h"
#include "services/work/job/job_folder.h"
#include "services/work/job/job_life.h"
#include "services/work/kinds/work_kind.h"
#include "services/work/pipeline/output_folder.h"

namespace weft {
namespace {

// A writer that was killed lets go of the folder a moment later.
constexpr std::chrono::seconds kLockTimeout{2};

v1::Job NewJob(const v1::RegistrationSpec& spec, const LoadedInputs& inputs) {
  v1::Job job = NewLocalJob(spec, inputs.hashes, inputs.warnings);
  if (inputs.driven) *job.mutable_driven() = *inputs.driven;
  return job;
}

// A job with those who watch it.
class LocalJob {
 public:
  LocalJob(const LocalJobRequest& request, Work& work, const std::string& out,
           const std::function<void(const v1::JobUpdate&)>& update)
      : work_(work),
        place_{out, request.limits, "", 0},
        update_(update),
        life_(NewJob(request.recorded, work.inputs()), work.inputs().frames),
        folder_(out, request.command) {}

  // Written before the first frame: a folder that cannot be written to is found now, not after an hour.
  absl::Status Begin() {
    life_.Start();
    WEFT_RETURN_IF_ERROR(folder_.Take(kLockTimeout));
    WEFT_RETURN_IF_ERROR(folder_.WriteJob(life_.Describe()));
    folder_.Clean(life_.frames().infos());
    return absl::OkStatus();
  }

  // Returns what Work::Run does, or why results do not stay.
  absl::Status ComputeAll(const std::stop_token& stop) {
    std::vector<size_t> frames(life_.frames().infos().size());
    std::iota(frames.begin(), frames.end(), size_t{0});
    for (;;) {
      WEFT_RETURN_IF_ERROR(folder_.Take(kLockTimeout));
      WEFT_RETURN_IF_ERROR(work_.Run(frames, place_, Events(), stop));
      const auto find = [this](const v1::Job& job, const std::vector<v1::FrameInfo>& infos) {
        return work_.FindIncomplete(job, infos);
      };
      WEFT_ASSIGN_OR_RETURN(const auto incomplete, folder_.Check(life_.job(), life_.frames().infos(), find));
      if (incomplete.empty()) return absl::OkStatus();
      WEFT_RETURN_IF_ERROR(life_.DoAgain(incomplete));
      frames.clear();
      for (const IncompleteFrame& frame : incomplete) {
        frames.push_back(frame.position);
        Report(frame.position);
      }
    }
  }

  // The job as it ended; `status` is what ComputeAll returned.
  absl::StatusOr<v1::Job> End(const absl::Status& status) {
    if (absl::IsCancelled(status)) {
      life_.Abort(v1::JOB_STATE_CANCELLED, "cancelled");
    } else if (!status.ok()) {
      life_.Abort(v1::JOB_STATE_FAILED, std::string(status.message()));
    }
    const std::vector<size_t> bridged = folder_.BridgedFrames(life_.frames().infos());
    v1::Job outcome = life_.Outcome(bridged);
    for (const size_t position : bridged) Report(position);
    const JobEndings endings{AssessJobFolder, WriteJobReport};
    const absl::Status written = folder_.Finish(life_.frames().infos(), endings, outcome);
    if (!status.ok() && !absl::IsCancelled(status)) return status;
    if (!written.ok()) return written;
    return outcome;
  }

 private:
  RegistrationEvents Events() {
    return {
        .started =
            [this](const std::string& frame) { Change(frame, [](JobFrames& f, size_t i) { f.Start(i); }); },
        .advanced =
            [this](const std::string& frame, double share) {
              Change(frame, [share](JobFrames& f, size_t i) { f.Advance(i, share); });
            },
        .finished =
            [this](const v1::FrameInfo& info) {
              Change(info.frame(), [&info](JobFrames& f, size_t i) { f.Finish(i, info); });
            }};
  }

  template <typename ChangeFrame>
  void Change(const std::string& frame, const ChangeFrame& change) {
    const std::optional<size_t> position = life_.frames().Find(frame);
    if (!position) return;
    change(life_.frames(), *position);
    Report(*position);
  }

  void Report(size_t position) const {
    if (!update_) return;
    v1::JobUpdate update;
    *update.mutable_job() = life_.Describe();
    *update.add_frames() = life_.frames().infos()[position];
    update_(update);
  }

  Work& work_;
  const WorkPlace place_;
  const std::function<void(const v1::JobUpdate&)>& update_;
  JobLife life_;
  JobFolder folder_;
};

}  // namespace

absl::StatusOr<v1::Job> RunLocalJob(const LocalJobRequest& asked,
                                    const std::function<void(const v1::JobUpdate&)>& update,
                                    const std::stop_token& stop) {
  LocalJobRequest request = asked;
  const WorkKind& kind = KindOf(asked.spec);
  WEFT_ASSIGN_OR_RETURN(*request.spec.mutable_options(), kind.Effective(asked.spec.options()));
  // Paths among the options are those of `recorded`.
  WEFT_ASSIGN_OR_RETURN(*request.recorded.mutable_options(), kind.Effective(asked.recorded.options()));
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<Work> work,
                        kind.Load(request.spec, WorkKind::LoadFor::kWholeJob));
  WEFT_RETURN_IF_ERROR(CheckOutOfInputs(request.spec));
  WEFT_ASSIGN_OR_RETURN(const std::string out, MakeOutputFolder(request.spec.out()));
  LocalJob job(request, *work, out, update);
  WEFT_RETURN_IF_ERROR(job.Begin());
  return job.End(job.ComputeAll(stop));
}

}  // namespace weft
