// Commands of kinds of jobs, made from their descriptions (services/work/spec/kind_info.h).
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/kind_options.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/run_job.h"
#include "services/tools/cli/upload_inputs.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

// WorkOf reads what stands at these places.
struct KindCommandOptions {
  std::map<std::string, std::vector<std::string>> values;
  std::map<std::string, std::string> texts;
  std::map<std::string, bool> flags;
  std::string out, frames;
  JobAtDaemon daemon;
  int threads = 0;
  bool json = false;
};

// "copy meshes" is `weft copy-meshes`.
std::string CommandOf(const v1::WorkKindInfo& kind) { return absl::StrReplaceAll(kind.name(), {{" ", "-"}}); }

absl::Status RunKindCommand(const v1::WorkKindInfo& kind, const CLI::App& command,
                            const KindCommandOptions& options, bool quiet) {
  v1::RegistrationSpec spec;
  spec.set_out(options.out);
  spec.set_frames(options.frames);
  std::vector<const CLI::Option*> others;
  *spec.mutable_work() = WorkOf(kind, command, &others);
  if (const auto fault = FaultOfWork(kind, spec.work(), CommandOf(kind)))
    return absl::InvalidArgumentError(
        absl::StrCat(fault->why, fault->remedy.empty() ? "" : "; ", fault->remedy));
  if (options.daemon.upload) {
    WEFT_ASSIGN_OR_RETURN(spec, UploadInputs(options.daemon.server, std::move(spec), quiet));
  }
  const StopOnSignal signals;
  JobRun run{std::move(spec), CommandOf(kind), options.daemon.server, options.daemon.priority, {}};
  run.limits.threads = options.threads;
  if (options.daemon.detach) return DetachJob(run);
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, RunJob(run, quiet, signals.token()));
  if (options.json) {
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(job));
  } else {
    if (job.has_verdict()) PrintVerdict(job.verdict());
    if (!quiet)
      std::printf("results  %s\nreport   %s/report.html\n", options.out.c_str(), options.out.c_str());
  }
  return OutcomeOf(job);
}

void AddKindCommand(CLI::App& app, CommandLine& line, const v1::WorkKindInfo& kind) {
  const std::string name = CommandOf(kind);
  std::string usage = "  weft " + name;
  for (const v1::WorkInputInfo& input : kind.inputs()) {
    if (input.is_required()) absl::StrAppend(&usage, input.is_positional() ? " " : " --", input.name());
    if (input.is_required() && !input.is_positional()) absl::StrAppend(&usage, " PATH");
  }
  usage += " --out result";
  CLI::App* command =
      AddCommand(app, name,
                 absl::StrCat(kind.about(),
                              " Units that are complete from an earlier run are kept, so a stopped run is "
                              "resumed."),
                 absl::StrCat(usage, "\n", usage, " --server 127.0.0.1:7411"));
  const auto options = std::make_shared<KindCommandOptions>();
  KindOptions add(*command, kind.name());
  for (const v1::WorkInputInfo& input : kind.inputs()) add(input.name(), options->values[input.name()]);
  AddRequired(*command, "--out DIR", options->out, "Folder for the results, made where it is missing");
  AddFramesOption(*command, options->frames, "Which units, all by default");
  for (const v1::WorkOptionInfo& option : kind.options()) {
    if (option.type() == v1::OPTION_TYPE_FLAG) {
      add(option.name(), options->flags[option.name()]);
    } else {
      add(option.name(), options->texts[option.name()] = option.preset());
    }
  }
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
  AddJobAtDaemon(
      *command, options->daemon,
      "send inputs of a library's kinds to the daemon's library first; as `weft register --upload`");
  command->add_flag("--json", options->json, "Print the job as JSON on standard output");
  command->callback([command, options, &line, &kind] {
    line.writes_remotely = !options->daemon.server.empty();
    line.run = [command, options, &line, &kind] {
      return RunKindCommand(kind, *command, *options, line.quiet);
    };
  });
}

}  // namespace

void AddKindCommands(CLI::App& app, CommandLine& line) {
  for (const v1::WorkKindInfo* kind : AllKindInfos()) {
    if (kind->start() == v1::WORK_START_JOB) AddKindCommand(app, line, *kind);
  }
}

}  // namespace weft
