// The life of a job from its first frame to its final state, wherever it runs.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "base/stopwatch.h"
#include "services/work/job/job_frames.h"
#include "services/work/pipeline/results_check.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/task.pb.h"

namespace weft {

// A job that this process computes itself, whose frames are still to come.
v1::Job NewLocalJob(const v1::RegistrationSpec& spec, const v1::InputHashes& inputs,
                    const std::vector<std::string>& warnings);

// Thread safety: none.
class JobLife {
 public:
  // A new job that waits. `job` has id, spec, inputs and warnings; `frames` are its frames by name, in order.
  JobLife(v1::Job job, const std::vector<std::string>& frames);
  // One that goes on or has ended, as it was written down.
  JobLife(v1::Job job, std::vector<v1::FrameInfo> frames);

  // Without counts and remaining time, which Describe adds.
  const v1::Job& job() const { return job_; }
  const JobFrames& frames() const { return frames_; }
  JobFrames& frames() { return frames_; }
  v1::Job Describe() const;

  void SetMessage(const std::string& message) { job_.set_message(message); }
  void SetPriority(int priority) { job_.set_priority(priority); }
  void AddWarning(const std::string& warning) { job_.add_warnings(warning); }

  // What its tasks took (JobUsage).
  void AddUsage(const v1::WorkerUsage& of_task);
  void CountTask(bool is_lost, double queued_s);
  void SetTaskLogs(const std::string& folder) { job_.set_task_logs(folder); }

  // Work begins. Whether that changed the job's state: one that goes on runs already.
  bool Start();

  // Whether the job's take may grow (spec.live_every).
  bool following() const { return job_.live().following(); }
  void Append(const std::vector<std::string>& frames);
  // The take will not grow any more, but tasks of the job run: no further ones begin.
  void HoldFrames() { frames_.SetLive(0); }
  // The take has ended, and no task runs. Where frames are refined by their neighbours, those that were
  // computed by themselves wait for that; the others wait for their turn.
  void StopFollowing(bool is_refined);
  void SetLatency(size_t position, double latency_s);

  // These frames wait again, since their results are not there or their inputs changed, of which a warning
  // tells. Aborted when that happened too often; the frames stay as they are then.
  absl::Status DoAgain(const std::vector<IncompleteFrame>& frames);

  // A job that has ended waits again: its failed and cancelled frames, with all their attempts. False: it has
  // none and followed no take, or has not ended; nothing has changed then.
  bool Retry();

  // The job is to end before all frames are dealt with: cancelled, or failed for a reason that is no frame's.
  // The first call counts.
  void Abort(v1::JobState state, const std::string& message);
  bool is_aborted() const { return early_.has_value(); }
  // The frames that wait or run, but for those of which `runs` is true, get no result.
  void CancelWaiting(const std::function<bool(size_t position)>& runs);
  const std::string& abort_message() const { return early_->message; }

  // The last state of the job. `bridged`: positions of failed frames that have a mesh all the same. Frames
  // that are not dealt with are cancelled; a job without any registered frame failed, and its message names
  // the first one and why. A warning tells of
  // results of an earlier run that were computed again.
  v1::Job Outcome(const std::vector<size_t>& bridged);
  // The outcome is written down; nothing changes any more.
  void Conclude(v1::Job outcome);

 private:
  struct EarlyEnd {
    v1::JobState state;
    std::string message;
  };

  void FollowIfLive();
  void ReportChangedInputs(const std::vector<IncompleteFrame>& frames);

  v1::Job job_;
  JobFrames frames_;
  std::optional<EarlyEnd> early_;
  std::optional<Stopwatch> started_;
  int repairs_ = 0;  // how often frames had to be done again
  bool ended_ = false;
};

}  // namespace weft
