#include "services/cli/local_registration.h"

#include <chrono>
#include <filesystem>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/files/atomic_file.h"
#include "services/files/json_file.h"
#include "services/pipeline/refine_frame.h"
#include "services/pipeline/registration.h"
#include "services/report/html_report.h"
#include "services/report/job_verdict.h"

namespace weft {
namespace {

int64_t UnixNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

// The job's record while its frames come in.
class JobRecord {
 public:
  JobRecord(const v1::RegistrationSpec& spec, const RegistrationInputs& inputs,
            const std::vector<size_t>& frames, const std::function<void(const v1::JobUpdate&)>& update)
      : update_(update) {
    const int64_t now = UnixNow();
    job_.set_id(absl::StrCat("local-", now / 1'000'000'000));
    *job_.mutable_spec() = spec;
    *job_.mutable_inputs() = inputs.hashes;
    job_.mutable_warnings()->Add(inputs.warnings.begin(), inputs.warnings.end());
    job_.set_state(v1::JOB_STATE_RUNNING);
    job_.mutable_frames()->set_total(static_cast<int>(frames.size()));
    job_.mutable_frames()->set_waiting(static_cast<int>(frames.size()));
    job_.set_first_frame(inputs.dump->frame_names()[frames.front()]);
    job_.set_last_frame(inputs.dump->frame_names()[frames.back()]);
    job_.set_created_unix_ns(now);
    job_.set_started_unix_ns(now);
    job_.set_remaining_s(-1);
    job_.set_weft_version(WEFT_VERSION);
  }

  const v1::Job& job() const { return job_; }

  void Started(const std::string& frame) {
    job_.mutable_frames()->set_waiting(job_.frames().waiting() - 1);
    job_.mutable_frames()->set_running(1);
    Advanced(frame, 0);
  }

  void Advanced(const std::string& frame, double share) {
    v1::FrameInfo info;
    info.set_frame(frame);
    info.set_state(v1::FRAME_STATE_RUNNING);
    info.set_share_done(share);
    Tell(info);
  }

  void Finished(const v1::FrameInfo& info) {
    v1::FrameCounts& frames = *job_.mutable_frames();
    frames.set_running(0);
    frames.set_reused(frames.reused() + info.reused());
    frames.set_done(frames.done() + (info.state() == v1::FRAME_STATE_DONE));
    frames.set_degraded(frames.degraded() + (info.state() == v1::FRAME_STATE_DEGRADED));
    frames.set_failed(frames.failed() + (info.state() == v1::FRAME_STATE_FAILED));
    if (info.state() == v1::FRAME_STATE_FAILED) failed_.push_back(info);
    Tell(info);
  }

  // `status` is what RegisterFrames answered: Ok or Cancelled.
  void End(const absl::Status& status) {
    v1::FrameCounts& frames = *job_.mutable_frames();
    frames.set_cancelled(frames.waiting() + frames.running());
    frames.set_waiting(0);
    frames.set_running(0);
    CountBridged();
    if (!status.ok()) {
      job_.set_state(v1::JOB_STATE_CANCELLED);
      job_.set_message(std::string(status.message()));
    } else if (frames.done() + frames.degraded() > 0) {
      job_.set_state(v1::JOB_STATE_DONE);
    } else {
      job_.set_state(v1::JOB_STATE_FAILED);
      job_.set_message(absl::StrCat("no frame could be registered; the last one, ", failed_.back().frame(),
                                    ": ", failed_.back().reason()));
    }
    job_.set_finished_unix_ns(UnixNow());
    job_.set_remaining_s(0);
    *job_.mutable_verdict() = JudgeJobFolder(job_.spec().out(), job_);
  }

 private:
  void CountBridged() {
    for (v1::FrameInfo& info : failed_) {
      info.set_bridged(WasBridged(job_.spec().out(), info.frame()));
      if (!info.bridged()) continue;
      job_.mutable_frames()->set_bridged(job_.frames().bridged() + 1);
      Tell(info);
    }
  }

  void Tell(const v1::FrameInfo& info) {
    if (!update_) return;
    v1::JobUpdate update;
    *update.mutable_job() = job_;
    *update.add_frames() = info;
    update_(update);
  }

  const std::function<void(const v1::JobUpdate&)>& update_;
  v1::Job job_;
  std::vector<v1::FrameInfo> failed_;
};

}  // namespace

absl::StatusOr<v1::Job> RegisterLocally(const v1::RegistrationSpec& spec, int threads,
                                        const std::function<void(const v1::JobUpdate&)>& update,
                                        std::stop_token stop) {
  const absl::StatusOr<std::unique_ptr<RegistrationInputs>> inputs = LoadInputs(spec);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<std::vector<size_t>> frames = FramesInRange(spec, (*inputs)->dump->frame_names());
  if (!frames.ok()) return frames.status();

  JobRecord record(spec, **inputs, *frames, update);
  const std::string job_file = (std::filesystem::path(spec.out()) / "job.json").string();
  // Written before the first frame: a folder that cannot be written to is found now, not after an hour.
  if (absl::Status status = CreateFolders(spec.out()); !status.ok()) return status;
  if (absl::Status status = WriteJsonFile(job_file, record.job()); !status.ok()) return status;

  const RegistrationEvents events{
      .started = [&](const std::string& frame) { record.Started(frame); },
      .advanced = [&](const std::string& frame, double share) { record.Advanced(frame, share); },
      .finished = [&](const v1::FrameInfo& info) { record.Finished(info); }};
  const absl::Status status = RegisterFrames(**inputs, *frames, *frames, spec.options(), spec.out(), threads,
                                             events, std::move(stop));
  if (!status.ok() && !absl::IsCancelled(status)) return status;
  record.End(status);
  if (absl::Status written = WriteJsonFile(job_file, record.job()); !written.ok()) return written;
  if (absl::Status written = WriteJobReport(spec.out(), record.job()); !written.ok()) return written;
  return record.job();
}

}  // namespace weft
