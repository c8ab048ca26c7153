#include "services/work/job/job_folder.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/confined_folder.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/no_threads.h"
#include "services/work/pipeline/frame_files.h"
#include "services/work/pipeline/refine_frame.h"

namespace weft {
namespace {

// A writer that was killed lets go of the lock a moment later.
constexpr std::chrono::milliseconds kLockTimeout{200};

// ResourceExhausted: there is no thread for it now.
absl::Status Assess(const std::string& out, const JobEndings& endings, v1::Job& job) {
  if (!endings.assess) return absl::OkStatus();
  try {
    *job.mutable_verdict() = endings.assess(out, job);
  } catch (const std::exception& error) {
    if (IsLackOfThreads(error)) return NoFurtherThreads();
    job.add_warnings(absl::StrCat("the job has no verdict: ", error.what()));
  }
  return absl::OkStatus();
}

absl::Status WriteReport(const std::string& out, const JobEndings& endings, const v1::Job& job) {
  if (!endings.write_report) return absl::OkStatus();
  try {
    return endings.write_report(out, job);
  } catch (const std::exception& error) {
    if (IsLackOfThreads(error)) return NoFurtherThreads();
    return absl::InternalError(absl::StrCat("the report cannot be written: ", error.what()));
  }
}

// What `weft register --evaluate` put beside an earlier report.html, which had the same measures.
absl::Status RemoveEvaluation(const std::string& out) {
  WEFT_ASSIGN_OR_RETURN(const ConfinedFolder folder, ConfinedFolder::Open(out));
  if (absl::IsNotFound(folder.Read("evaluation.json").status())) return absl::OkStatus();
  for (const char* name : {"frames.csv", "cameras.csv", "evaluation.json"})
    if (absl::Status status = folder.Remove(name); !status.ok()) return folder.InWords(status);
  return absl::OkStatus();
}

}  // namespace

absl::Status JobFolder::Take(std::chrono::milliseconds patience) {
  if (lock_) {
    const absl::Status status = lock_->Renew();
    if (!status.ok()) lock_.reset();
    return status;
  }
  WEFT_RETURN_IF_ERROR(CreateFolders(out_));
  absl::StatusOr<ResultLock> taken = ResultLock::Acquire(out_, owner_, patience);
  if (taken.ok()) lock_ = *std::move(taken);
  return taken.status();
}

absl::StatusOr<std::vector<IncompleteFrame>> JobFolder::Check(const v1::Job& job,
                                                              const std::vector<v1::FrameInfo>& frames,
                                                              const FindIncomplete& find) {
  WEFT_RETURN_IF_ERROR(Take(kLockTimeout));
  Clean(frames);
  // Nothing can be missing of a job that begins; finding that out costs a daemon a process.
  if (std::ranges::none_of(frames, [](const v1::FrameInfo& frame) { return HasResult(frame.state()); }))
    return std::vector<IncompleteFrame>();
  v1::Job here = job;
  here.mutable_spec()->set_out(out_);
  return find(here, frames);
}

void JobFolder::Clean(const std::vector<v1::FrameInfo>& frames) const {
  std::vector<std::string> names;
  for (const v1::FrameInfo& info : frames) names.push_back(info.frame());
  RemoveTemporaryFiles(out_, names);
}

std::vector<size_t> JobFolder::BridgedFrames(const std::vector<v1::FrameInfo>& frames) const {
  std::vector<size_t> bridged;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].state() == v1::FRAME_STATE_FAILED && WasBridged(out_, frames[i].frame())) {
      bridged.push_back(i);
    }
  }
  return bridged;
}

absl::Status JobFolder::WriteJob(const v1::Job& job) const {
  WEFT_ASSIGN_OR_RETURN(const ConfinedFolder folder, ConfinedFolder::Open(out_));
  return folder.InWords(WriteJsonFile(folder.At(kJobFile), job));
}

absl::Status JobFolder::Finish(const std::vector<v1::FrameInfo>& frames, const JobEndings& endings,
                               v1::Job& job) {
  WEFT_RETURN_IF_ERROR(Take(kLockTimeout));
  WEFT_RETURN_IF_ERROR(Assess(out_, endings, job));
  Clean(frames);
  WEFT_RETURN_IF_ERROR(WriteJob(job));
  WEFT_RETURN_IF_ERROR(RemoveEvaluation(out_));
  return WriteReport(out_, endings, job);
}

}  // namespace weft
