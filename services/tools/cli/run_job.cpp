#include "services/tools/cli/run_job.h"

#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/timed_id.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/command_line.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/upload_inputs.h"
#include "services/tools/client/fetch_results.h"
#include "services/work/kinds/local_job.h"
#include "services/work/pipeline/output_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// A file in the output folder by which the daemon recognises that it sees the same folder.
class Probe {
 public:
  static absl::StatusOr<Probe> Create(const std::string& folder) {
    WEFT_RETURN_IF_ERROR(CreateFolders(folder));
    Probe probe(fs::path(folder) / absl::StrCat(".weft-probe-", getpid(), "-", HostTime_ns()));
    WEFT_RETURN_IF_ERROR(WriteFileAtomically(probe.path_.string(), "weft\n"));
    return probe;
  }
  Probe(Probe&& other) noexcept : path_(std::move(other.path_)) { other.path_.clear(); }
  Probe& operator=(Probe&&) = delete;
  ~Probe() {
    if (!path_.empty()) RemoveFile(path_);
  }

  std::string name() const { return path_.filename().string(); }

 private:
  explicit Probe(fs::path path) : path_(std::move(path)) {}

  fs::path path_;
};

// The daemon writes into spec.out itself when it sees the same folder, otherwise below its own state folder
// (then the returned job's spec.out is another).
absl::StatusOr<v1::Job> Submit(RegistrationClient& client, const v1::RegistrationSpec& spec, int priority) {
  WEFT_RETURN_IF_ERROR(CheckOutOfInputs(spec));
  WEFT_ASSIGN_OR_RETURN(const Probe probe, Probe::Create(spec.out()));
  v1::SubmitJobRequest request;
  *request.mutable_spec() = spec;
  request.set_out_probe(probe.name());
  request.set_idempotency_key(NewTimedId());
  request.set_priority(priority);
  return client.Submit(request);
}

// Brings the results to spec.out where the daemon could not write there. A stop cancels the job.
absl::StatusOr<v1::Job> RunJobAtDaemon(const JobRun& run, bool quiet,
                                       const std::function<void(const v1::JobUpdate&)>& update,
                                       const std::stop_token& stop) {
  WEFT_ASSIGN_OR_RETURN(const auto client, RegistrationClient::Connect(run.server));
  const v1::RegistrationSpec spec = WithAbsolutePaths(run.spec);
  WEFT_ASSIGN_OR_RETURN(const v1::Job submitted, Submit(*client, spec, run.priority));
  const std::string& id = submitted.id();
  absl::StatusOr<v1::Job> job = client->Watch(id, update, stop);
  if (stop.stop_requested()) {
    WEFT_RETURN_IF_ERROR(client->Cancel(id).status());
    job = client->Watch(id, update);
  }
  if (!job.ok()) {
    return absl::Status(job.status().code(),
                        absl::StrCat(job.status().message(), "; the job is ", id,
                                     ", see it with `weft job watch ", id, " --server ", run.server, "`"));
  }
  if (AbsolutePath(job->spec().out()) == spec.out()) return job;
  StageBars bars(quiet);
  const auto fetched = [&bars](size_t done, size_t total) { bars.Set("fetch", done, total); };
  WEFT_RETURN_IF_ERROR(FetchResults(*client, *job, spec.out(), fetched, stop));
  return job;
}

}  // namespace

void AddJobAtDaemon(CLI::App& command, JobAtDaemon& daemon, const std::string& upload) {
  AddServerOption(command, daemon.server, "Let the daemon at HOST:PORT do the work");
  command.add_flag("--upload", daemon.upload, "With --server: " + upload);
  AddOption(command, "--priority N", daemon.priority,
            "With --server: of your jobs those of higher priority are worked on first; above 10 they go "
            "before everybody's, which is for operators",
            CLI::Range(-100, 100));
  command.add_flag("--detach", daemon.detach, "With --server: print the job's id and do not wait for it");
}

absl::StatusOr<v1::Job> RunJob(const JobRun& run, bool quiet, const std::stop_token& stop) {
  JobView view(quiet, run.command);
  bool is_told = false;
  const auto show = [&](const v1::JobUpdate& update) {
    if (!is_told) {
      for (const std::string& warning : update.job().warnings()) PrintWarning(warning);
    }
    is_told = true;
    view.Show(update);
  };
  if (run.server.empty()) {
    return RunLocalJob({.spec = run.spec,
                        .recorded = WithAbsolutePaths(run.spec),
                        .command = absl::StrCat("weft ", run.command),
                        .limits = run.limits},
                       show, stop);
  }
  return RunJobAtDaemon(run, quiet, show, stop);
}

absl::Status DetachJob(const JobRun& run) {
  if (run.server.empty())
    return absl::InvalidArgumentError("--detach leaves the job to a daemon, so it needs --server HOST:PORT");
  WEFT_ASSIGN_OR_RETURN(const auto client, RegistrationClient::Connect(run.server));
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, Submit(*client, WithAbsolutePaths(run.spec), run.priority));
  std::printf("%s\n", job.id().c_str());
  return absl::OkStatus();
}

}  // namespace weft
