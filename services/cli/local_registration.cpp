#include "services/cli/local_registration.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/files/confined_folder.h"
#include "services/files/json_file.h"
#include "services/pipeline/frame_files.h"
#include "services/pipeline/output_folder.h"
#include "services/pipeline/refine_frame.h"
#include "services/pipeline/registration.h"
#include "services/pipeline/result_lock.h"
#include "services/pipeline/results_check.h"
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
            const std::vector<size_t>& positions, const std::function<void(const v1::JobUpdate&)>& update)
      : update_(update), frames_(positions.size()) {
    for (size_t i = 0; i < positions.size(); ++i) {
      frames_[i].set_frame(inputs.dump->frame_names()[positions[i]]);
      frames_[i].set_state(v1::FRAME_STATE_WAITING);
    }
    const int64_t now = UnixNow();
    job_.set_id(absl::StrCat("local-", now / 1'000'000'000));
    *job_.mutable_spec() = spec;
    *job_.mutable_inputs() = inputs.hashes;
    job_.mutable_warnings()->Add(inputs.warnings.begin(), inputs.warnings.end());
    job_.set_state(v1::JOB_STATE_RUNNING);
    Count();
    job_.set_first_frame(frames_.front().frame());
    job_.set_last_frame(frames_.back().frame());
    job_.set_created_unix_ns(now);
    job_.set_started_unix_ns(now);
    job_.set_remaining_s(-1);
    job_.set_weft_version(WEFT_VERSION);
  }

  const v1::Job& job() const { return job_; }

  // All frames of the job in order, with the states that they have by now.
  const std::vector<v1::FrameInfo>& frames() const { return frames_; }

  void Started(const std::string& frame) { Advanced(frame, 0); }

  void Advanced(const std::string& frame, double share) {
    v1::FrameInfo info;
    info.set_frame(frame);
    info.set_state(v1::FRAME_STATE_RUNNING);
    info.set_share_done(share);
    Change(info);
  }

  void Finished(const v1::FrameInfo& info) { Change(info); }

  void DoAgain(size_t position) {
    v1::FrameInfo info;
    info.set_frame(frames_[position].frame());
    info.set_state(v1::FRAME_STATE_WAITING);
    Change(info);
  }

  // `status` is what RegisterFrames answered: Ok or Cancelled.
  void End(const absl::Status& status) {
    for (v1::FrameInfo& info : frames_) {
      const bool left = info.state() == v1::FRAME_STATE_WAITING || info.state() == v1::FRAME_STATE_RUNNING;
      if (left) info.set_state(v1::FRAME_STATE_CANCELLED);
    }
    NameBridged();
    Count();
    const v1::FrameCounts& frames = job_.frames();
    if (!status.ok()) {
      job_.set_state(v1::JOB_STATE_CANCELLED);
      job_.set_message(std::string(status.message()));
    } else if (frames.done() + frames.degraded() > 0) {
      job_.set_state(v1::JOB_STATE_DONE);
    } else {
      job_.set_state(v1::JOB_STATE_FAILED);
      job_.set_message(absl::StrCat("no frame could be registered; the last one, ", frames_.back().frame(),
                                    ": ", frames_.back().reason()));
    }
    job_.set_finished_unix_ns(UnixNow());
    job_.set_remaining_s(0);
    *job_.mutable_verdict() = JudgeJobFolder(job_.spec().out(), job_);
  }

 private:
  void NameBridged() {
    for (v1::FrameInfo& info : frames_) {
      if (info.state() != v1::FRAME_STATE_FAILED) continue;
      info.set_bridged(WasBridged(job_.spec().out(), info.frame()));
      if (info.bridged()) Change(v1::FrameInfo(info));
    }
  }

  void Change(const v1::FrameInfo& info) {
    const auto changed = std::find_if(frames_.begin(), frames_.end(), [&info](const v1::FrameInfo& frame) {
      return frame.frame() == info.frame();
    });
    if (changed != frames_.end()) *changed = info;
    Count();
    Tell(info);
  }

  void Count() {
    v1::FrameCounts counts;
    counts.set_total(static_cast<int>(frames_.size()));
    for (const v1::FrameInfo& info : frames_) {
      counts.set_waiting(counts.waiting() + (info.state() == v1::FRAME_STATE_WAITING));
      counts.set_running(counts.running() + (info.state() == v1::FRAME_STATE_RUNNING));
      counts.set_done(counts.done() + (info.state() == v1::FRAME_STATE_DONE));
      counts.set_degraded(counts.degraded() + (info.state() == v1::FRAME_STATE_DEGRADED));
      counts.set_failed(counts.failed() + (info.state() == v1::FRAME_STATE_FAILED));
      counts.set_cancelled(counts.cancelled() + (info.state() == v1::FRAME_STATE_CANCELLED));
      counts.set_reused(counts.reused() + info.reused());
      counts.set_bridged(counts.bridged() + info.bridged());
    }
    *job_.mutable_frames() = counts;
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
  std::vector<v1::FrameInfo> frames_;
};

// Registers all frames, and again those whose results are not there at the end. Returns what RegisterFrames
// does, or why results do not stay.
absl::Status RegisterAll(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames,
                         const v1::RegistrationSpec& spec, int threads, JobRecord& record, ResultLock& lock,
                         const std::stop_token& stop) {
  const RegistrationEvents events{
      .started = [&](const std::string& frame) { record.Started(frame); },
      .advanced = [&](const std::string& frame, double share) { record.Advanced(frame, share); },
      .finished = [&](const v1::FrameInfo& info) { record.Finished(info); }};
  std::vector<size_t> frames = job_frames;
  for (int repairs = 0;; ++repairs) {
    if (absl::Status status = lock.Renew(); !status.ok()) return status;
    const absl::Status status =
        RegisterFrames(inputs, job_frames, frames, spec.options(), spec.out(), threads, events, stop);
    if (!status.ok()) return status;
    v1::Job job = record.job();
    *job.mutable_spec() = spec;
    const auto incomplete = FindIncompleteFrames(job, record.frames());
    if (!incomplete.ok()) return incomplete.status();
    if (incomplete->empty()) return absl::OkStatus();
    const IncompleteFrame& first = incomplete->front();
    if (repairs == kMaxRepairs) {
      return TooManyRepairs(spec.out(), record.frames()[first.position].frame(), first.why);
    }
    frames.clear();
    for (const IncompleteFrame& frame : *incomplete) {
      record.DoAgain(frame.position);
      frames.push_back(job_frames[frame.position]);
    }
  }
}

std::vector<std::string> NamesOf(const std::vector<v1::FrameInfo>& frames) {
  std::vector<std::string> names;
  for (const v1::FrameInfo& info : frames) names.push_back(info.frame());
  return names;
}

absl::Status WriteJob(const std::string& out, const v1::Job& job) {
  const absl::StatusOr<ConfinedFolder> folder = ConfinedFolder::Open(out);
  if (!folder.ok()) return folder.status();
  return folder->InWords(WriteJsonFile(folder->At("job.json"), job));
}

}  // namespace

absl::StatusOr<v1::Job> RegisterLocally(const v1::RegistrationSpec& spec, int threads,
                                        const std::function<void(const v1::JobUpdate&)>& update,
                                        std::stop_token stop) {
  const absl::StatusOr<std::unique_ptr<RegistrationInputs>> inputs = LoadInputs(spec);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<std::vector<size_t>> frames = FramesInRange(spec, (*inputs)->dump->frame_names());
  if (!frames.ok()) return frames.status();
  if (absl::Status status = CheckOutOfInputs(spec); !status.ok()) return status;

  JobRecord record(spec, **inputs, *frames, update);
  // Written before the first frame: a folder that cannot be written to is found now, not after an hour.
  const absl::StatusOr<std::string> out = MakeOutputFolder(spec.out());
  if (!out.ok()) return out.status();
  absl::StatusOr<ResultLock> lock = ResultLock::Acquire(*out, "weft register", std::chrono::seconds(2));
  if (!lock.ok()) return lock.status();
  if (absl::Status status = WriteJob(*out, record.job()); !status.ok()) return status;
  RemoveTemporaryFiles(*out, NamesOf(record.frames()));

  v1::RegistrationSpec resolved = spec;
  resolved.set_out(*out);
  const absl::Status status = RegisterAll(**inputs, *frames, resolved, threads, record, *lock, stop);
  if (!status.ok() && !absl::IsCancelled(status)) return status;
  record.End(status);
  RemoveTemporaryFiles(*out, NamesOf(record.frames()));
  if (absl::Status written = WriteJob(*out, record.job()); !written.ok()) return written;
  if (absl::Status written = WriteJobReport(*out, record.job()); !written.ok()) return written;
  return record.job();
}

}  // namespace weft
