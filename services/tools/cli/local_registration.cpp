#include "services/tools/cli/local_registration.h"

#include <chrono>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "services/formats/options/presets.h"
#include "services/results/report/html_report.h"
#include "services/results/report/job_verdict.h"
#include "services/tools/cli/absolute_paths.h"
#include "services/work/job/job_folder.h"
#include "services/work/job/job_life.h"
#include "services/work/pipeline/output_folder.h"
#include "services/work/pipeline/registration.h"

namespace weft {
namespace {

// A writer that was killed lets go of the folder a moment later.
constexpr std::chrono::seconds kPatience{2};

// A job whose frames this process registers, with those who watch it.
class LocalJob {
 public:
  LocalJob(const v1::RegistrationSpec& spec, const RegistrationInputs& inputs, std::vector<size_t> positions,
           const std::string& out, const std::function<void(const v1::JobUpdate&)>& update)
      : inputs_(inputs),
        positions_(std::move(positions)),
        out_(out),
        update_(update),
        life_(NewJob(spec, inputs), NamesOf(inputs, positions_)),
        folder_(out, "weft register") {}

  // Written before the first frame: a folder that cannot be written to is found now, not after an hour.
  absl::Status Begin() {
    life_.Start();
    WEFT_RETURN_IF_ERROR(folder_.Take(kPatience));
    WEFT_RETURN_IF_ERROR(folder_.WriteJob(life_.Describe()));
    folder_.Clean(life_.frames().infos());
    return absl::OkStatus();
  }

  // Registers all frames, and again those whose results are not there at the end. Returns what RegisterFrames
  // does, or why results do not stay.
  absl::Status RegisterAll(const RegistrationLimits& limits, const std::stop_token& stop) {
    std::vector<size_t> frames = positions_;
    for (;;) {
      WEFT_RETURN_IF_ERROR(folder_.Take(kPatience));
      WEFT_RETURN_IF_ERROR(RegisterFrames(inputs_, positions_, frames, life_.job().spec().options(), out_,
                                          limits, Events(), stop));
      WEFT_ASSIGN_OR_RETURN(const auto incomplete,
                            folder_.Check(life_.job(), life_.frames().infos(), FindIncompleteFrames));
      if (incomplete.empty()) return absl::OkStatus();
      WEFT_RETURN_IF_ERROR(life_.DoAgain(incomplete));
      frames.clear();
      for (const IncompleteFrame& frame : incomplete) {
        frames.push_back(positions_[frame.position]);
        Tell(frame.position);
      }
    }
  }

  // The job as it ended; `status` is what RegisterAll returned.
  absl::StatusOr<v1::Job> End(const absl::Status& status) {
    if (absl::IsCancelled(status)) {
      life_.EndEarly(v1::JOB_STATE_CANCELLED, "cancelled");
    } else if (!status.ok()) {
      life_.EndEarly(v1::JOB_STATE_FAILED, std::string(status.message()));
    }
    const std::vector<size_t> bridged = folder_.BridgedFrames(life_.frames().infos());
    v1::Job outcome = life_.Outcome(bridged);
    for (const size_t position : bridged) Tell(position);
    const JobEndings endings{AssessJobFolder, WriteJobReport};
    const absl::Status written = folder_.Finish(life_.frames().infos(), endings, outcome);
    if (!status.ok() && !absl::IsCancelled(status)) return status;
    if (!written.ok()) return written;
    return outcome;
  }

 private:
  static v1::Job NewJob(const v1::RegistrationSpec& spec, const RegistrationInputs& inputs) {
    v1::Job job;
    job.set_id(absl::StrCat("local-", HostTime_ns() / 1'000'000'000));
    *job.mutable_spec() = spec;
    *job.mutable_inputs() = inputs.hashes;
    job.mutable_warnings()->Add(inputs.warnings.begin(), inputs.warnings.end());
    return job;
  }

  static std::vector<std::string> NamesOf(const RegistrationInputs& inputs,
                                          const std::vector<size_t>& positions) {
    std::vector<std::string> names;
    for (const size_t position : positions) names.push_back(inputs.dump->frame_names()[position]);
    return names;
  }

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
    Tell(*position);
  }

  void Tell(size_t position) const {
    if (!update_) return;
    v1::JobUpdate update;
    *update.mutable_job() = life_.Describe();
    *update.add_frames() = life_.frames().infos()[position];
    update_(update);
  }

  const RegistrationInputs& inputs_;
  const std::vector<size_t> positions_;  // in the dump
  const std::string out_;
  const std::function<void(const v1::JobUpdate&)>& update_;
  JobLife life_;
  JobFolder folder_;
};

}  // namespace

absl::StatusOr<v1::Job> RegisterLocally(const v1::RegistrationSpec& asked, const RegistrationLimits& limits,
                                        const std::function<void(const v1::JobUpdate&)>& update,
                                        std::stop_token stop) {
  WEFT_ASSIGN_OR_RETURN(v1::RegistrationOptions options, EffectiveOptions(asked.options()));
  v1::RegistrationSpec spec = asked;
  *spec.mutable_options() = std::move(options);
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<RegistrationInputs> inputs, LoadInputs(spec));
  WEFT_ASSIGN_OR_RETURN(std::vector<size_t> frames, FramesInRange(spec, inputs->dump->frame_names()));
  WEFT_RETURN_IF_ERROR(AddExtraWarnings(spec, frames, *inputs));
  WEFT_RETURN_IF_ERROR(CheckOutOfInputs(spec));
  WEFT_ASSIGN_OR_RETURN(const std::string out, MakeOutputFolder(spec.out()));
  // Others read job.json from other folders.
  LocalJob job(WithAbsolutePaths(spec), *inputs, std::move(frames), out, update);
  WEFT_RETURN_IF_ERROR(job.Begin());
  return job.End(job.RegisterAll(limits, stop));
}

}  // namespace weft
