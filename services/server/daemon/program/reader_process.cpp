#include "services/server/daemon/program/reader_process.h"

#include <sys/mman.h>
#include <unistd.h>

#include <stdexcept>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/work/executor/run_program.h"
#include "services/work/reading/run_reading.h"

namespace weft {
namespace {

constexpr size_t kMostAnswerBytes = size_t{256} << 20;

// A file in memory: a disk that is full does not keep anybody from reading.
absl::StatusOr<UniqueFd> FileInMemory(const std::string& bytes) {
  UniqueFd file(memfd_create("reading", MFD_CLOEXEC));
  if (!file.open()) return WriteError("a file in memory", errno);
  if (const int error = WriteAll(file.get(), bytes); error != 0) return WriteError("a file in memory", error);
  return file;
}

v1::Reading WithLinks(const LinkRules& rules) {
  v1::Reading reading;
  reading.mutable_allowed_paths()->Assign(rules.allowed.begin(), rules.allowed.end());
  reading.set_closed_folder(rules.closed);
  return reading;
}

}  // namespace

absl::StatusOr<v1::ReadingAnswer> ReaderProcess::Run(const v1::Reading& reading) {
  free_.acquire();
  const absl::Cleanup release = [this] { free_.release(); };
  WEFT_ASSIGN_OR_RETURN(const UniqueFd asked, FileInMemory(reading.SerializeAsString()));
  ProgramRun run;
  run.arguments = {"--read", absl::StrCat("--parent=", getpid()),
                   absl::StrCat("--memory-mib=", options_.memory_mib)};
  if (!options_.worker_user.empty()) run.arguments.push_back(absl::StrCat("--user=", options_.worker_user));
  run.input = absl::StrCat("/proc/self/fd/", asked.get());
  run.patience = options_.patience;
  run.most_bytes = kMostAnswerBytes;
  run.hides_secrets = true;
  const absl::StatusOr<std::string> said = RunProgram(options_.program, run);
  if (absl::IsInternal(said.status())) {
    return absl::InvalidArgumentError(
        absl::StrCat("reading the files ended its process, so they are damaged or made to do so: ",
                     said.status().message()));
  }
  if (!said.ok()) return said.status();
  v1::ReadingAnswer answer;
  if (!answer.ParseFromString(*said)) return absl::InternalError("a reader's answer is none");
  const absl::Status status = StatusOf(answer);
  if (status.ok()) return answer;
  if (!absl::IsResourceExhausted(status)) return status;
  return absl::ResourceExhaustedError(
      absl::StrCat(status.message(), "; a reader has ", options_.memory_mib, " MiB"));
}

void ReadInProcesses(DaemonOptions& options) {
  const LinkRules rules = {.allowed = options.allow_paths, .closed = options.state_folder};
  ReaderOptions reader_options;
  reader_options.program = options.worker_program;
  reader_options.worker_user = options.worker_user;
  const auto readers = std::make_shared<ReaderProcess>(reader_options);
  options.load_inputs = [readers, rules](const v1::RegistrationSpec& spec) -> absl::StatusOr<LoadedInputs> {
    v1::Reading reading = WithLinks(rules);
    *reading.mutable_job_inputs() = spec;
    WEFT_ASSIGN_OR_RETURN(const v1::ReadingAnswer answer, readers->Run(reading));
    LoadedInputs inputs;
    inputs.frames.assign(answer.frames().begin(), answer.frames().end());
    inputs.hashes = answer.hashes();
    inputs.warnings.assign(answer.warnings().begin(), answer.warnings().end());
    if (answer.has_driven()) inputs.driven = answer.driven();
    if (inputs.frames.empty()) return absl::InternalError("a reader found no frames, and no reason");
    return inputs;
  };
  options.find_incomplete = [readers, rules](const v1::Job& job, const std::vector<v1::FrameInfo>& frames)
      -> absl::StatusOr<std::vector<IncompleteFrame>> {
    v1::Reading reading = WithLinks(rules);
    *reading.mutable_incomplete()->mutable_job() = job;
    reading.mutable_incomplete()->mutable_frames()->Assign(frames.begin(), frames.end());
    WEFT_ASSIGN_OR_RETURN(const v1::ReadingAnswer answer, readers->Run(reading));
    std::vector<IncompleteFrame> incomplete;
    for (const v1::ReadingAnswer::Incomplete& one : answer.incomplete()) {
      if (one.position() < 0 || one.position() >= static_cast<int64_t>(frames.size()))
        return absl::InternalError("a reader named a frame that the job lacks");
      incomplete.push_back({static_cast<size_t>(one.position()), one.why(), one.inputs_changed()});
    }
    return incomplete;
  };
  options.endings.assess = [readers, rules](const std::string& out, const v1::Job& job) {
    v1::Reading reading = WithLinks(rules);
    *reading.mutable_assess()->mutable_job() = job;
    reading.mutable_assess()->set_out(out);
    const absl::StatusOr<v1::ReadingAnswer> answer = readers->Run(reading);
    if (!answer.ok()) throw std::runtime_error(std::string(answer.status().message()));
    return answer->verdict();
  };
  options.endings.write_report = [readers, rules](const std::string& out, const v1::Job& job) {
    v1::Reading reading = WithLinks(rules);
    *reading.mutable_write_report()->mutable_job() = job;
    reading.mutable_write_report()->set_out(out);
    return readers->Run(reading).status();
  };
  options.check_item = [readers](v1::ItemKind kind, const v1::ItemManifest& manifest,
                                 const std::string& folder) {
    v1::Reading reading;
    reading.mutable_item()->set_kind(kind);
    *reading.mutable_item()->mutable_manifest() = manifest;
    reading.mutable_item()->set_folder(folder);
    return readers->Run(reading).status();
  };
}

}  // namespace weft
