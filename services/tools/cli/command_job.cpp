// weft job: the jobs of a daemon.
#include <cstdio>
#include <memory>

#include "absl/time/time.h"
#include "base/status_macros.h"
#include "services/ground/process/command_option.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/client/fetch_results.h"
#include "services/tools/client/registration_client.h"
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

using Client = std::unique_ptr<RegistrationClient>;

struct Context {
  const JobCommandOptions& options;
  bool quiet;
  std::stop_token stop;
};

std::string LocalTime(int64_t unix_ns) {
  if (unix_ns == 0) return "-";
  return absl::FormatTime("%Y-%m-%d %H:%M:%S", absl::FromUnixNanos(unix_ns), absl::LocalTimeZone());
}

absl::Status ListJobs(RegistrationClient& client, const Context& context) {
  const JobCommandOptions& options = context.options;
  WEFT_ASSIGN_OR_RETURN(const std::vector<v1::Job> jobs, client.List(options.limit));
  if (options.json) {
    v1::ListJobsResponse response;
    response.mutable_jobs()->Assign(jobs.begin(), jobs.end());
    *response.mutable_warnings() = client.info().warnings();
    return PrintJsonMessage(response);
  }
  for (const std::string& warning : client.info().warnings())
    std::fprintf(stderr, "weft: warning: %s\n", warning.c_str());
  if (jobs.empty()) std::printf("no jobs at %s\n", client.server().c_str());
  for (const v1::Job& job : jobs) {
    const v1::FrameCounts& frames = job.frames();
    std::printf("%s  %-9s  %5d/%d frames  %s  %s\n", job.id().c_str(), JobStateWord(job.state()),
                frames.done() + frames.degraded(), frames.total(), LocalTime(job.created_unix_ns()).c_str(),
                job.spec().dump().c_str());
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
  std::printf("created   %s\nstarted   %s\nfinished  %s\n", LocalTime(job.created_unix_ns()).c_str(),
              LocalTime(job.started_unix_ns()).c_str(), LocalTime(job.finished_unix_ns()).c_str());
  if (const v1::JobUsage& usage = job.usage(); usage.tasks() > 0) {
    std::printf("tasks     %d, %d of them lost; %.0f core-seconds, at most %.0f MiB, %.0f s queued\n",
                usage.tasks(), usage.tasks_lost(), usage.core_s(), usage.peak_memory_mib(), usage.queued_s());
  }
  if (!job.task_logs().empty()) std::printf("logs      %s\n", job.task_logs().c_str());
  for (const std::string& warning : job.warnings()) std::printf("warning   %s\n", warning.c_str());
}

absl::Status Show(RegistrationClient& client, const Context& context) {
  const JobCommandOptions& options = context.options;
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, client.Get(options.job_id));
  WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameInfo> frames, client.Frames(options.job_id));
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

absl::Status Watch(RegistrationClient& client, const Context& context) {
  const JobCommandOptions& options = context.options;
  const bool quiet = context.quiet;
  absl::StatusOr<v1::Job> job;
  {
    JobView view(quiet);
    job = client.Watch(
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

absl::Status Cancel(RegistrationClient& client, const Context& context) {
  const JobCommandOptions& options = context.options;
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, client.Cancel(options.job_id));
  if (options.json) return PrintJsonMessage(job);
  if (!context.quiet)
    std::printf("%s: %s, %s\n", job.id().c_str(), JobStateWord(job.state()), JobText(job).c_str());
  return absl::OkStatus();
}

absl::Status Retry(RegistrationClient& client, const Context& context) {
  const JobCommandOptions& options = context.options;
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, client.Retry(options.job_id));
  if (options.json) return PrintJsonMessage(job);
  const v1::FrameCounts& frames = job.frames();
  if (!context.quiet && frames.waiting() + frames.running() == 0)
    std::printf("%s: %s, no frame failed or was cancelled\n", job.id().c_str(), JobStateWord(job.state()));
  else if (!context.quiet)
    std::printf("%s: %s, %d frames wait; `weft job watch %s` shows them\n", job.id().c_str(),
                JobStateWord(job.state()), frames.waiting(), job.id().c_str());
  return absl::OkStatus();
}

absl::Status Fetch(RegistrationClient& client, const Context& context) {
  const JobCommandOptions& options = context.options;
  const bool quiet = context.quiet;
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, client.Get(options.job_id));
  {
    StageBars bars(quiet);
    const auto progress = [&bars](size_t done, size_t total) { bars.Set("fetch", done, total); };
    WEFT_RETURN_IF_ERROR(FetchResults(client, job, options.out, progress, context.stop));
  }
  if (!quiet) std::printf("%s\nresults  %s\n", JobText(job).c_str(), options.out.c_str());
  return absl::OkStatus();
}

using Action = absl::Status (*)(RegistrationClient& client, const Context& context);

// What the subcommands take besides --server.
enum Takes : unsigned { kNothing = 0, kJobId = 1, kJson = 2, kLimit = 4, kOut = 8 };

// A subcommand that connects before it acts. Each has options of its own: WEFT_SERVER sets those of all.
void AddAction(CLI::App& parent, CommandLine& line, const std::string& name, const std::string& description,
               unsigned takes, Action action) {
  CLI::App* command = AddCommand(parent, name, description, "");
  auto options = std::make_shared<JobCommandOptions>();
  AddServerOption(*command, options->server, "HOST:PORT of the daemon")->required();
  if (takes & kJobId) {
    command->add_option("JOB", options->job_id, "Id of the job, as `weft job list` prints it")->required();
  }
  if (takes & kLimit) {
    AddOption(*command, "--limit N", options->limit, "At most this many", CLI::Range(1, 1000));
  }
  if (takes & kOut) {
    AddRequired(*command, "--out DIR", options->out, "Folder for the results, made where it is missing");
  }
  if (takes & kJson) command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, action, &line] {
    line.run = [options, action, &line] {
      const StopOnSignal signals;
      WEFT_ASSIGN_OR_RETURN(const Client client, RegistrationClient::Connect(options->server));
      return action(*client, {*options, line.quiet, signals.token()});
    };
  });
}

}  // namespace

void AddJobCommand(CLI::App& app, CommandLine& line) {
  CLI::App* job = AddCommand(app, "job", "Look after the jobs of a daemon, and plan large ones",
                             "  weft job list --server 127.0.0.1:7411\n"
                             "  WEFT_SERVER=127.0.0.1:7411 weft job watch 20260131-104500-1a2b3c4d");
  job->require_subcommand(1);
  AddAction(*job, line, "list", "List jobs, the newest first", kLimit | kJson, ListJobs);
  AddAction(*job, line, "show", "Show a job and each of its frames", kJobId | kJson, Show);
  AddAction(*job, line, "watch",
            "Follow a job until it has ended. Stopping the command leaves the job alone. The exit status is "
            "that of `weft register`",
            kJobId | kJson, Watch);
  AddAction(*job, line, "cancel", "Stop a job. Finished frames stay", kJobId | kJson, Cancel);
  AddAction(*job, line, "retry",
            "Register the failed and cancelled frames of a job that has ended once more, as with new disks "
            "or workers. Finished frames stay",
            kJobId | kJson, Retry);
  AddJobPlanCommand(*job, line);
  AddAction(*job, line, "fetch", "Copy a job's results to this machine", kJobId | kOut, Fetch);
}

}  // namespace weft
