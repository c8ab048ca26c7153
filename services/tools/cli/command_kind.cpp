// Commands of kinds of jobs, made from their descriptions (services/work/spec/kind_info.h).
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status_macros.h"
#include "services/ground/process/command_option.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/run_job.h"
#include "services/tools/cli/upload_inputs.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

struct KindOptions {
  std::map<std::string, std::vector<std::string>> inputs;
  std::map<std::string, std::string> options;
  std::map<std::string, bool> flags;
  std::string out, frames, server;
  int threads = 0, priority = 0;
  bool detach = false, upload = false, json = false;
};

// "copy meshes" is `weft copy-meshes`.
std::string CommandOf(const v1::WorkKindInfo& kind) { return absl::StrReplaceAll(kind.name(), {{" ", "-"}}); }

void AddValue(const std::string& name, const std::string& value, v1::NamedValue* added) {
  added->set_name(name);
  added->set_value(value);
}

v1::RegistrationSpec SpecOfKind(const v1::WorkKindInfo& kind, const KindOptions& options) {
  v1::RegistrationSpec spec;
  spec.set_out(options.out);
  spec.set_frames(options.frames);
  v1::WorkSpec& work = *spec.mutable_work();
  work.set_kind(kind.name());
  for (const v1::WorkInputInfo& input : kind.inputs()) {
    for (const std::string& path : options.inputs.at(input.name()))
      AddValue(input.name(), path, work.add_inputs());
  }
  for (const v1::WorkOptionInfo& option : kind.options()) {
    if (option.type() == v1::OPTION_TYPE_FLAG) {
      if (options.flags.at(option.name())) AddValue(option.name(), "", work.add_options());
    } else if (const std::string& value = options.options.at(option.name()); !value.empty()) {
      AddValue(option.name(), value, work.add_options());
    }
  }
  return spec;
}

absl::Status RunKindCommand(const v1::WorkKindInfo& kind, const KindOptions& options, bool quiet) {
  v1::RegistrationSpec spec = SpecOfKind(kind, options);
  if (const auto fault = FaultOfWork(kind, spec.work(), CommandOf(kind)))
    return absl::InvalidArgumentError(
        absl::StrCat(fault->why, fault->remedy.empty() ? "" : "; ", fault->remedy));
  if (options.upload) {
    WEFT_ASSIGN_OR_RETURN(spec, UploadInputs(options.server, std::move(spec), quiet));
  }
  const StopOnSignal signals;
  JobRun run{std::move(spec), CommandOf(kind), options.server, options.priority, {}};
  run.limits.threads = options.threads;
  if (options.detach) return DetachJob(run);
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

void AddInputs(CLI::App& command, const v1::WorkKindInfo& kind, KindOptions& options) {
  for (const v1::WorkInputInfo& input : kind.inputs()) {
    std::vector<std::string>& values = options.inputs[input.name()];
    CLI::Option* added =
        command.add_option(input.is_positional() ? input.name() : "--" + input.name(), values, input.label());
    added->required(input.is_required())->type_name("PATH");
    if (!input.may_repeat()) added->expected(1);
  }
}

void AddOptions(CLI::App& command, const v1::WorkKindInfo& kind, KindOptions& options) {
  for (const v1::WorkOptionInfo& option : kind.options()) {
    const std::string name = "--" + option.name();
    if (option.type() == v1::OPTION_TYPE_FLAG) {
      command.add_flag(name, options.flags[option.name()], option.label());
      continue;
    }
    CLI::Option* added = command.add_option(name, options.options[option.name()], option.label());
    added->required(option.is_required())->default_str(option.preset());
    added->type_name(option.type() == v1::OPTION_TYPE_TEXT ? "TEXT" : "N");
    if (!option.choices().empty()) added->check(OneOf({option.choices().begin(), option.choices().end()}));
  }
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
  const auto options = std::make_shared<KindOptions>();
  AddInputs(*command, kind, *options);
  AddRequired(*command, "--out DIR", options->out, "Folder for the results, made where it is missing");
  AddFramesOption(*command, options->frames, "Which units, all by default");
  AddOptions(*command, kind, *options);
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
  AddServerOption(*command, options->server, "Let the daemon at HOST:PORT do the work");
  command->add_flag("--upload", options->upload,
                    "With --server: send inputs of a library's kinds to the daemon's library first");
  AddOption(*command, "--priority N", options->priority,
            "With --server: of your jobs those of higher priority are worked on first",
            CLI::Range(-100, 100));
  command->add_flag("--detach", options->detach, "With --server: print the job's id and do not wait for it");
  command->add_flag("--json", options->json, "Print the job as JSON on standard output");
  command->callback([options, &line, &kind] {
    line.writes_remotely = !options->server.empty();
    line.run = [options, &line, &kind] { return RunKindCommand(kind, *options, line.quiet); };
  });
}

}  // namespace

void AddKindCommands(CLI::App& app, CommandLine& line) {
  for (const v1::WorkKindInfo* kind : AllKindInfos()) {
    if (kind->start() == v1::WORK_START_JOB) AddKindCommand(app, line, *kind);
  }
}

}  // namespace weft
