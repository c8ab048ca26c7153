// weft job: the jobs of a daemon.
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/remote_command.h"
#include "services/tools/client/fetch_results.h"
#include "services/work/kinds/work_kind.h"

namespace weft {
namespace {

struct JobCommandOptions {
  std::string server;
  std::string job_id;
  std::string out;
  int limit = 20;
  bool json = false;
};

using JobContext = RemoteContext<RegistrationClient, JobCommandOptions>;

std::string LocalTime(int64_t unix_ns) {
  if (unix_ns == 0) return "-";
  return absl::FormatTime("%Y-%m-%d %H:%M:%S", absl::FromUnixNanos(unix_ns), absl::LocalTimeZone());
}

absl::Status ListJobs(const JobContext& context) {
  const JobCommandOptions& options = context.options;
  WEFT_ASSIGN_OR_RETURN(const std::vector<v1::Job> jobs, context.client.List(options.limit));
  if (options.json) {
    v1::ListJobsResponse response;
    response.mutable_jobs()->Assign(jobs.begin(), jobs.end());
    *response.mutable_warnings() = context.client.info().warnings();
    return PrintJsonMessage(response);
  }
  for (const std::string& warning : context.client.info().warnings())
    std::fprintf(stderr, "weft: warning: %s\n", warning.c_str());
  if (jobs.empty()) std::printf("no jobs at %s\n", context.client.server().c_str());
  for (const v1::Job& job : jobs) {
    const v1::FrameCounts& frames = job.frames();
    const std::string priority = job.priority() == 0 ? "" : absl::StrCat("  priority ", job.priority());
    std::printf("%s  %-9s  %5d/%d frames  %s  %s%s\n", job.id().c_str(), JobStateWord(job.state()),
                frames.done() + frames.degraded(), frames.total(), LocalTime(job.created_unix_ns()).c_str(),
                job.spec().dump().c_str(), priority.c_str());
  }
  return absl::OkStatus();
}

void PrintJob(const v1::Job& job) {
  std::printf("job       %s\nstate     %s%s%s\n", job.id().c_str(), JobStateWord(job.state()),
              job.message().empty() ? "" : ": ", job.message().c_str());
  std::printf("frames    %s\n", JobText(job).c_str());
  if (job.state() == v1::JOB_STATE_RUNNING && job.remaining_s() >= 0) {
    std::printf("left      about %.0f s\n", job.remaining_s());
  }
  std::printf("dump      %s\nrig       %s  %s\nboard     %s  %s\ntemplate  %s  %s\nresults   %s\n",
              job.spec().dump().c_str(), job.spec().rig().c_str(), job.inputs().rig().c_str(),
              job.spec().board().c_str(), job.inputs().board().c_str(), job.spec().garment().c_str(),
              job.inputs().garment().c_str(), job.spec().out().c_str());
  std::printf("priority  %d\ncreated   %s\nstarted   %s\nfinished  %s\n", job.priority(),
              LocalTime(job.created_unix_ns()).c_str(), LocalTime(job.started_unix_ns()).c_str(),
              LocalTime(job.finished_unix_ns()).c_str());
  if (const v1::JobUsage& usage = job.usage(); usage.tasks() > 0) {
    std::printf("tasks     %d, %d of them lost; %.0f core-seconds, at most %.0f MiB, %.0f s queued\n",
                usage.tasks(), usage.tasks_lost(), usage.core_s(), usage.peak_memory_mib(), usage.queued_s());
  }
  if (!job.task_logs().empty()) std::printf("logs      %s\n", job.task_logs().c_str());
  for (const std::string& warning : job.warnings()) std::printf("warning   %s\n", warning.c_str());
}

absl::Status Show(const JobContext& context) {
  const JobCommandOptions& options = context.options;
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, context.client.Get(options.job_id));
  WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameInfo> frames, context.client.Frames(options.job_id));
  if (options.json) {
    v1::JobUpdate all;
    *all.mutable_job() = job;
    all.mutable_frames()->Assign(frames.begin(), frames.end());
    return PrintJsonMessage(all);
  }
  if (job.has_verdict()) PrintVerdict(job.verdict());
  PrintJob(job);
  const bool has_coverage = KindOf(job.spec()).has_coverage();
  for (const v1::FrameInfo& frame : frames) std::printf("%s\n", FrameLine(frame, has_coverage).c_str());
  return absl::OkStatus();
}

absl::Status Watch(const JobContext& context) {
  const JobCommandOptions& options = context.options;
  const bool quiet = context.quiet;
  absl::StatusOr<v1::Job> job;
  {
    JobView view(quiet);
    job = context.client.Watch(
        options.job_id, [&view](const v1::JobUpdate& update) { view.Show(update); }, context.stop);
  }
  if (!job.ok()) return job.status();
  if (options.json) {
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(*job));
  } else if (!quiet) {
    if (job->has_verdict()) PrintVerdict(job->verdict());
    std::printf("%s\nresults  %s\n", JobText(*job).c_str(), job->spec().out().c_str());
  }
  return OutcomeOf(*job);
}

absl::Status Cancel(const JobContext& context) {
  return PrintAnswer(context.client.Cancel(context.options.job_id), context, [](const v1::Job& job) {
    std::printf("%s: %s, %s\n", job.id().c_str(), JobStateWord(job.state()), JobText(job).c_str());
  });
}

absl::Status Retry(const JobContext& context) {
  return PrintAnswer(context.client.Retry(context.options.job_id), context, [](const v1::Job& job) {
    const v1::FrameCounts& frames = job.frames();
    const std::string what =
        frames.waiting() + frames.running() == 0
            ? "no frame failed or was cancelled"
            : absl::StrCat(frames.waiting(), " frames wait; `weft job watch ", job.id(), "` shows them");
    std::printf("%s: %s, %s\n", job.id().c_str(), JobStateWord(job.state()), what.c_str());
  });
}

absl::Status Fetch(const JobContext& context) {
  const JobCommandOptions& options = context.options;
  const bool quiet = context.quiet;
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, context.client.Get(options.job_id));
  {
    StageBars bars(quiet);
    const auto progress = [&bars](size_t done, size_t total) { bars.Set("fetch", done, total); };
    WEFT_RETURN_IF_ERROR(FetchResults(context.client, job, options.out, progress, context.stop));
  }
  if (!quiet) std::printf("%s\nresults  %s\n", JobText(job).c_str(), options.out.c_str());
  return absl::OkStatus();
}

void AddJobId(CLI::App& command, JobCommandOptions& options) {
  AddRequired(command, "JOB", options.job_id, "Id of the job, as `weft job list` prints it");
}

void AddFetchArguments(CLI::App& command, JobCommandOptions& options) {
  AddJobId(command, options);
  AddRequired(command, "--out DIR", options.out, "Folder for the results, made where it is missing");
}

}  // namespace

void AddJobCommand(CLI::App& app, CommandLine& line) {
  CLI::App* job = AddGroup(app, "job", "Look after the jobs of a daemon, and plan large ones",
                           "  weft job list --server 127.0.0.1:7411\n"
                           "  WEFT_SERVER=127.0.0.1:7411 weft job watch 20260131-104500-1a2b3c4d");
  const RemoteCommand<RegistrationClient, JobCommandOptions> commands[] = {
      {"list", "List jobs, the newest first", "", AddListLimit, ListJobs},
      {"show", "Show a job and each of its frames", "", AddJobId, Show},
      {"watch",
       "Follow a job until it has ended. Stopping the command leaves the job alone. The exit status is that "
       "of `weft register`",
       "", AddJobId, Watch},
      {"cancel", "Stop a job. Finished frames stay", "", AddJobId, Cancel},
      {"retry",
       "Register the failed and cancelled frames of a job that has ended once more, as with new disks or "
       "workers. Finished frames stay",
       "", AddJobId, Retry},
      {"fetch", "Copy a job's results to this machine", "", AddFetchArguments, Fetch, false}};
  for (const auto& command : commands) AddRemoteCommand(*job, line, command);
  AddJobPlanCommand(*job, line);
}

}  // namespace weft
