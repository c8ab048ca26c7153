#include "services/work/animation/drive_take.h"

#include <chrono>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "services/results/report/html_report.h"
#include "services/results/report/job_verdict.h"
#include "services/work/animation/drive_frames.h"
#include "services/work/animation/drive_inputs.h"
#include "services/work/animation/driven_frame.h"
#include "services/work/job/job_folder.h"
#include "services/work/job/job_life.h"
#include "services/work/pipeline/output_folder.h"

namespace weft {
namespace {

// A writer that was killed lets go of the folder a moment later.
constexpr std::chrono::seconds kDrivePatience{2};

class TakeDrive {
 public:
  TakeDrive(const v1::RegistrationSpec& spec, const DriveInputs& inputs, const DriveFrameList& list,
            std::string out, const DriveProgress& progress)
      : inputs_(inputs),
        list_(list),
        out_(std::move(out)),
        progress_(progress),
        life_(NewDriveJob(spec, inputs), list.Names()),
        folder_(out_, "weft avatar drive") {}

  absl::StatusOr<v1::Job> Run(int threads, const std::stop_token& stop) {
    life_.Start();
    absl::Status status = folder_.Take(kDrivePatience);
    if (status.ok()) status = folder_.WriteJob(life_.Describe());
    if (!status.ok()) return status;
    folder_.Clean(life_.frames().infos());
    status = DriveAll(threads, stop);
    if (absl::IsCancelled(status)) {
      life_.EndEarly(v1::JOB_STATE_CANCELLED, "cancelled");
    } else if (!status.ok()) {
      life_.EndEarly(v1::JOB_STATE_FAILED, std::string(status.message()));
    }
    v1::Job job = life_.Outcome({});
    const JobEndings endings{AssessJobFolder, WriteJobReport};
    const absl::Status written = folder_.Finish(life_.frames().infos(), endings, job);
    if (!status.ok() && !absl::IsCancelled(status)) return status;
    if (!written.ok()) return written;
    return job;
  }

 private:
  absl::Status DriveAll(int threads, const std::stop_token& stop) {
    std::vector<size_t> all(list_.size());
    std::iota(all.begin(), all.end(), size_t{0});
    size_t done = 0;
    RegistrationEvents events;
    events.started = [this](const std::string& frame) { life_.frames().Start(*life_.frames().Find(frame)); };
    events.finished = [&](const v1::FrameInfo& info) {
      life_.frames().Finish(*life_.frames().Find(info.frame()), info);
      if (progress_) progress_(++done, list_.size(), info);
    };
    return DriveFrames(life_.job().spec(), inputs_, list_, all, out_, threads, events, stop);
  }

  const DriveInputs& inputs_;
  const DriveFrameList& list_;
  const std::string out_;
  const DriveProgress& progress_;
  JobLife life_;
  JobFolder folder_;
};

}  // namespace

v1::Job NewDriveJob(const v1::RegistrationSpec& spec, const DriveInputs& inputs) {
  v1::Job job;
  job.set_id(absl::StrCat("local-", HostTime_ns() / 1'000'000'000));
  *job.mutable_spec() = spec;
  *job.mutable_inputs() = inputs.hashes;
  job.mutable_warnings()->Add(inputs.warnings.begin(), inputs.warnings.end());
  *job.mutable_driven() = DescribeDriving(spec, inputs);
  return job;
}

absl::StatusOr<v1::Job> DriveTake(const v1::RegistrationSpec& spec, int threads,
                                  const DriveProgress& progress, const std::stop_token& stop) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<DriveInputs> inputs, LoadDriveInputs(spec));
  WEFT_ASSIGN_OR_RETURN(const DriveFrameList list, ListDriveFrames(spec, *inputs));
  WEFT_RETURN_IF_ERROR(CheckOutOfInputs(spec));
  WEFT_ASSIGN_OR_RETURN(std::string out, MakeOutputFolder(spec.out()));
  return TakeDrive(spec, *inputs, list, std::move(out), progress).Run(threads, stop);
}

}  // namespace weft
