#include "services/tools/cli/run_job.h"

#include <cstdio>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/absolute_paths.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/remote_registration.h"
#include "services/work/kinds/local_job.h"

namespace weft {

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
  StageBars bars(quiet);
  const auto fetched = [&bars](size_t done, size_t total) { bars.Set("fetch", done, total); };
  return RegisterRemotely(run.server, run.spec, run.priority, show, fetched, stop);
}

absl::Status DetachJob(const JobRun& run) {
  if (run.server.empty())
    return absl::InvalidArgumentError("--detach leaves the job to a daemon, so it needs --server HOST:PORT");
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, SubmitRemotely(run.server, run.spec, run.priority));
  std::printf("%s\n", job.id().c_str());
  return absl::OkStatus();
}

}  // namespace weft
