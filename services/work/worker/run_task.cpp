#include "services/work/worker/run_task.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/error_reason.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/work/kinds/work_kind.h"
#include "services/work/pipeline/job_confinement.h"
#include "services/work/pipeline/registration.h"

namespace weft {
namespace {

// Positions of the task's frames among those of its job.
absl::StatusOr<std::vector<size_t>> FindFrames(const v1::Task& task, const std::vector<std::string>& names) {
  std::unordered_map<std::string, size_t> position;
  for (size_t i = 0; i < names.size(); ++i) position.emplace(names[i], i);
  std::vector<size_t> frames;
  for (const std::string& name : task.frames()) {
    const auto found = position.find(name);
    if (found == position.end()) {
      return absl::InvalidArgumentError(absl::StrCat("frames: the dump ", task.spec().dump(),
                                                     " holds no frame \"", name, "\"; was it changed?"));
    }
    frames.push_back(found->second);
  }
  return frames;
}

void TellEvents(const std::function<void(const v1::WorkerEvent&)>& report, RegistrationEvents& events) {
  events.started = [&report](const std::string& frame) {
    v1::WorkerEvent event;
    event.mutable_started()->set_frame(frame);
    report(event);
  };
  events.advanced = [&report](const std::string& frame, double share) {
    v1::WorkerEvent event;
    event.mutable_advanced()->set_frame(frame);
    event.mutable_advanced()->set_share_done(share);
    report(event);
  };
  events.finished = [&report](const v1::FrameInfo& info) {
    v1::WorkerEvent event;
    *event.mutable_finished() = info;
    report(event);
  };
}

bool WasRemoved(const UniqueFd& folder) {
  struct stat info;
  return folder.open() && fstat(folder.get(), &info) == 0 && info.st_nlink == 0;
}

absl::Status RunFrames(const v1::Task& task, const RegistrationEvents& events, const std::stop_token& stop) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<Work> work,
                        KindOf(task.spec()).Load(task.spec(), WorkKind::LoadFor::kTask));
  WEFT_ASSIGN_OR_RETURN(const std::vector<size_t> frames, FindFrames(task, work->inputs().frames));
  const WorkPlace place = {.out = task.spec().out(),
                           .limits = {.threads = task.threads()},
                           .scratch_folder = task.scratch_folder(),
                           .scratch_bytes = static_cast<uint64_t>(task.scratch_mib()) << 20};
  return work->Run(frames, place, events, stop);
}

absl::Status Run(const v1::Task& task, const UniqueFd& out,
                 const std::function<void(const v1::WorkerEvent&)>& report, std::stop_token stop) {
  if (task.frames().empty()) return absl::InvalidArgumentError("frames: the task names none");
  if (task.threads() < 0) return absl::InvalidArgumentError("threads: must not be negative");
  if (task.spec().out().empty()) return absl::InvalidArgumentError("spec.out: must not be empty");
  RegistrationEvents events;
  TellEvents(report, events);
  const absl::Status done = RunFrames(task, events, stop);
  if (done.ok() || !WasRemoved(out)) return done;
  return absl::CancelledError(
      absl::StrCat(task.spec().out(), ": was removed, so this worker may write nowhere; the next one may"));
}

}  // namespace

absl::Status ReportedToDaemon(const absl::Status& status,
                              const std::function<void(const v1::WorkerEvent&)>& report) {
  if (!status.ok()) {
    v1::WorkerEvent event;
    event.mutable_error()->set_code(absl::StatusCodeToString(status.code()));
    event.mutable_error()->set_message(std::string(status.message()));
    event.mutable_error()->set_reason(static_cast<v1::ErrorReason>(ReasonOf(status)));
    report(event);
  }
  return status;
}

absl::StatusOr<UniqueFd> ConfineToTask(const v1::Task& task,
                                       const std::function<void(const v1::WorkerEvent&)>& report) {
  const LinkRules links = {.allowed = {task.allowed_paths().begin(), task.allowed_paths().end()},
                           .closed = task.state_folder()};
  // Somebody may have removed it meanwhile, and a rule needs a folder.
  absl::Status status = task.spec().out().empty() ? absl::OkStatus() : CreateFolders(task.spec().out());
  if (status.ok() && !task.scratch_folder().empty()) status = CreateFolders(task.scratch_folder());
  UniqueFd out(open(task.spec().out().c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  Confinement confinement = ConfinementOf(task.spec(), links);
  if (!task.scratch_folder().empty()) {
    // Of the node, whose administrator may have put links into its path.
    std::error_code error;
    const auto scratch = std::filesystem::canonical(task.scratch_folder(), error);
    if (!error) confinement.writable.push_back(scratch);
  }
  if (status.ok()) status = ConfineProcess(confinement);
  if (!status.ok()) return ReportedToDaemon(status, report);
  return out;
}

absl::Status RunTask(const v1::Task& task, const UniqueFd& out,
                     const std::function<void(const v1::WorkerEvent&)>& report, std::stop_token stop) {
  return ReportedToDaemon(Run(task, out, report, std::move(stop)), report);
}

}  // namespace weft
