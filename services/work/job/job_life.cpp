#include "services/work/job/job_life.h"

#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "capture/file/plain_text.h"
#include "capture/rig/camera_match.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {
namespace {

std::vector<v1::FrameInfo> Waiting(const std::vector<std::string>& names) {
  std::vector<v1::FrameInfo> infos(names.size());
  for (size_t i = 0; i < names.size(); ++i) {
    infos[i].set_frame(names[i]);
    infos[i].set_state(v1::FRAME_STATE_WAITING);
  }
  return infos;
}

std::string FirstFailure(const JobFrames& frames) {
  for (const v1::FrameInfo& info : frames.infos()) {
    if (info.state() != v1::FRAME_STATE_FAILED) continue;
    return absl::StrCat("; the first, frame ", info.frame(), ": ", info.reason());
  }
  return "";
}

// One line per stage and reason: what became of results that stood in the folder.
void TellOfRedone(const JobFrames& frames, v1::Job& job) {
  std::map<std::string, int> count_of;
  for (const v1::FrameInfo& info : frames.infos()) {
    if (!info.redone_from().empty()) ++count_of[RedoneText(info.redone_from(), info.redone_because())];
  }
  for (const auto& [text, count] : count_of) {
    const std::string warning = absl::StrCat(count, count == 1 ? " frame" : " frames", " of an earlier run ",
                                             count == 1 ? "was " : "were ", text);
    // A job that was retried has told of it before.
    const auto& told = job.warnings();
    if (std::ranges::find(told, warning) == told.end()) job.add_warnings(warning);
  }
}

}  // namespace

v1::Job NewLocalJob(const v1::RegistrationSpec& spec, const v1::InputHashes& inputs,
                    const std::vector<std::string>& warnings) {
  v1::Job job;
  job.set_id(absl::StrCat("local-", HostTime_ns() / 1'000'000'000));
  *job.mutable_spec() = spec;
  *job.mutable_inputs() = inputs;
  job.mutable_warnings()->Add(warnings.begin(), warnings.end());
  return job;
}

JobLife::JobLife(v1::Job job, const std::vector<std::string>& frames)
    : job_(std::move(job)), frames_(Waiting(frames)) {
  job_.set_state(v1::JOB_STATE_QUEUED);
  job_.set_created_unix_ns(HostTime_ns());
  job_.set_weft_version(WEFT_VERSION);
  if (!frames.empty()) {
    job_.set_first_frame(frames.front());
    job_.set_last_frame(frames.back());
  }
  if (job_.spec().live_every() > 0) job_.mutable_live()->set_following(true);
  FollowIfLive();
  job_ = Describe();
}

JobLife::JobLife(v1::Job job, std::vector<v1::FrameInfo> frames)
    : job_(std::move(job)),
      frames_(std::move(frames)),
      ended_(job_.state() == v1::JOB_STATE_DONE || job_.state() == v1::JOB_STATE_FAILED ||
             job_.state() == v1::JOB_STATE_CANCELLED) {
  if (!ended_ && job_.ends_as() != v1::JOB_STATE_UNSPECIFIED)
    early_ = EarlyEnd{job_.ends_as(), job_.ends_because()};
  FollowIfLive();
}

void JobLife::FollowIfLive() {
  if (following()) frames_.SetLive(job_.spec().live_every());
}

v1::Job JobLife::Describe() const {
  constexpr double kEnoughFrames = 0.2;  // before that the guess would jump
  v1::Job job = job_;
  *job.mutable_frames() = frames_.Counts();
  job.set_remaining_s(ended_ ? 0 : -1);
  if (following()) {
    job.mutable_live()->set_sets_recorded(static_cast<int>(frames_.infos().size()));
    job.mutable_live()->set_backlog(frames_.Backlog());
    return job;
  }
  const double computed = frames_.FramesComputed();
  if (!ended_ && started_ && computed >= kEnoughFrames) {
    job.set_remaining_s(started_->Seconds() * frames_.FramesLeft() / computed);
  }
  return job;
}

void JobLife::AddUsage(const v1::WorkerUsage& of_task) {
  v1::JobUsage& usage = *job_.mutable_usage();
  usage.set_core_s(usage.core_s() + of_task.core_s());
  usage.set_worker_s(usage.worker_s() + of_task.wall_s());
  usage.set_peak_memory_mib(std::max(usage.peak_memory_mib(), of_task.peak_memory_mib()));
}

void JobLife::CountTask(bool is_lost, double queued_s) {
  v1::JobUsage& usage = *job_.mutable_usage();
  usage.set_tasks(usage.tasks() + 1);
  usage.set_tasks_lost(usage.tasks_lost() + (is_lost ? 1 : 0));
  usage.set_queued_s(usage.queued_s() + queued_s);
}

bool JobLife::Start() {
  if (!started_) started_.emplace();
  if (job_.state() != v1::JOB_STATE_QUEUED) return false;
  job_.set_state(v1::JOB_STATE_RUNNING);
  job_.set_started_unix_ns(HostTime_ns());
  return true;
}

void JobLife::Append(const std::vector<std::string>& frames) {
  if (frames.empty()) return;
  frames_.Append(frames);
  if (job_.first_frame().empty()) job_.set_first_frame(frames.front());
  job_.set_last_frame(frames.back());
}

void JobLife::StopFollowing(bool is_refined) {
  job_ = Describe();
  job_.mutable_live()->set_following(false);
  job_.mutable_live()->set_backlog(0);
  frames_.SetLive(std::nullopt);
  if (!is_refined) return;
  for (size_t i = 0; i < frames_.infos().size(); ++i) {
    const v1::FrameInfo& info = frames_.infos()[i];
    // One that killed its workers would do so again.
    const bool set_aside = info.state() == v1::FRAME_STATE_FAILED && info.attempts() >= kMaxAttempts;
    if (frames_.IsProcessed(i) && !set_aside) frames_.DoAgain(i);
  }
}

void JobLife::SetLatency(size_t position, double latency_s) {
  frames_.SetLatency(position, latency_s);
  job_.mutable_live()->set_latency_s(latency_s);
  job_.mutable_live()->set_coverage(frames_.infos()[position].coverage());
}

absl::Status JobLife::DoAgain(const std::vector<IncompleteFrame>& frames) {
  if (frames.empty()) return absl::OkStatus();
  if (repairs_ == kMaxRepairs) {
    const IncompleteFrame& first = frames.front();
    return TooManyRepairs(job_.spec().out(), frames_.infos()[first.position].frame(), first.why);
  }
  for (const IncompleteFrame& frame : frames) frames_.DoAgain(frame.position);
  ++repairs_;
  ReportChangedInputs(frames);
  return absl::OkStatus();
}

void JobLife::ReportChangedInputs(const std::vector<IncompleteFrame>& frames) {
  std::vector<std::string> names;
  for (const IncompleteFrame& frame : frames) {
    if (frame.inputs_changed) names.push_back(frames_.infos()[frame.position].frame());
  }
  if (names.empty()) return;
  job_.add_warnings(absl::StrCat("images, scan or start of ", FirstNames(names),
                                 " changed while the job ran; ",
                                 names.size() == 1 ? "this frame was" : "these frames were",
                                 " registered again from what is there now"));
}

bool JobLife::Retry() {
  if (!ended_) return false;
  bool any = following();  // frames may have come since
  for (size_t i = 0; i < frames_.infos().size(); ++i) {
    const v1::FrameState state = frames_.infos()[i].state();
    if (state != v1::FRAME_STATE_FAILED && state != v1::FRAME_STATE_CANCELLED) continue;
    frames_.DoAgain(i);
    any = true;
  }
  if (!any) return false;
  job_.set_state(v1::JOB_STATE_QUEUED);
  job_.set_message("");
  job_.set_started_unix_ns(0);
  job_.set_finished_unix_ns(0);
  job_.clear_verdict();
  early_.reset();
  started_.reset();
  repairs_ = 0;
  ended_ = false;
  FollowIfLive();
  return true;
}

void JobLife::Abort(v1::JobState state, const std::string& message) {
  if (early_) return;
  early_ = EarlyEnd{state, EscapedText(message)};
  job_.set_ends_as(early_->state);
  job_.set_ends_because(early_->message);
}

void JobLife::CancelWaiting(const std::function<bool(size_t position)>& runs) {
  for (size_t i = 0; i < frames_.infos().size(); ++i) {
    if (!runs(i) && !frames_.IsProcessed(i))
      frames_.End(i, v1::FRAME_STATE_CANCELLED, early_ ? early_->message : "");
  }
}

v1::Job JobLife::Outcome(const std::vector<size_t>& bridged) {
  for (const size_t position : bridged) frames_.Bridge(position);
  CancelWaiting([](size_t) { return false; });
  v1::Job job = Describe();
  job.clear_ends_as();
  job.clear_ends_because();
  job.set_state(v1::JOB_STATE_DONE);
  job.set_message("");
  if (early_) {
    job.set_state(early_->state);
    job.set_message(early_->message);
  } else if (job.frames().done() + job.frames().degraded() == 0) {
    job.set_state(v1::JOB_STATE_FAILED);
    job.set_message(absl::StrCat("no frame could be registered", FirstFailure(frames_)));
  }
  TellOfRedone(frames_, job);
  job.set_finished_unix_ns(HostTime_ns());
  job.set_remaining_s(0);
  return job;
}

void JobLife::Conclude(v1::Job outcome) {
  job_ = std::move(outcome);
  ended_ = true;
}

}  // namespace weft
