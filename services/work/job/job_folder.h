// What is done to the folder of a job's results: its lock, the check of what is there, and the job's own
// files.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/work/pipeline/result_lock.h"
#include "services/work/pipeline/results_check.h"
#include "weft/v1/job.pb.h"

namespace weft {

// What a job that has ended gets from its results; functions that are left out do nothing.
struct JobEndings {
  std::function<v1::Verdict(const std::string& out, const v1::Job& job)> assess;
  std::function<absl::Status(const std::string& out, const v1::Job& job)> write_report;
};

// Frames whose results are not there, among those that are dealt with (results_check.h).
using FindIncomplete = std::function<absl::StatusOr<std::vector<IncompleteFrame>>(
    const v1::Job& job, const std::vector<v1::FrameInfo>& frames)>;

// Thread safety: none.
class JobFolder {
 public:
  // `out` is an absolute path without links. `owner` in words, for those who find the folder locked.
  JobFolder(std::string out, std::string owner) : out_(std::move(out)), owner_(std::move(owner)) {}

  // Makes the folder where it is missing, and takes its lock where it is not held. Errors of ResultLock.
  absl::Status Take(std::chrono::milliseconds patience);
  void LetGo() { lock_.reset(); }

  // Takes the folder, removes what killed writers left, and looks for results that are not there. `find` is
  // not called for a job none of whose frames HasResult.
  absl::StatusOr<std::vector<IncompleteFrame>> Check(const v1::Job& job,
                                                     const std::vector<v1::FrameInfo>& frames,
                                                     const FindIncomplete& find);
  // Removes what killed writers left of the frames' files and of the job's.
  void Clean(const std::vector<v1::FrameInfo>& frames) const;

  // Positions of the failed frames that have a mesh from the frames around them. Certain once all frames are
  // dealt with.
  std::vector<size_t> BridgedFrames(const std::vector<v1::FrameInfo>& frames) const;

  absl::Status WriteJob(const v1::Job& job) const;
  // Locks the folder and writes the job's verdict, job.json and the report. What assess or report throw
  // costs the verdict or the report, nothing else.
  absl::Status Finish(const std::vector<v1::FrameInfo>& frames, const JobEndings& endings, v1::Job& job);

 private:
  std::string out_, owner_;
  std::optional<ResultLock> lock_;
};

}  // namespace weft
