// weft register: from a dump to registered meshes.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "services/formats/options/presets.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/results/evaluation/evaluate_job.h"
#include "services/results/evaluation/evaluation_report.h"
#include "services/studio/recording/session_file.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/pipeline_flags.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/run_job.h"
#include "services/tools/cli/upload_inputs.h"

namespace weft {
namespace {

struct RegisterOptions {
  RegisterOptions() {
    spec.mutable_options()->set_preset(kDefaultPreset);
    spec.mutable_options()->set_cloud_format("ply");
  }

  v1::RegistrationSpec spec;  // its paths, its frames, and all texts of its options
  PipelineFlags pipeline;
  JobAtDaemon daemon;
  int live_every = 0;
  bool observations = false;
  bool frames_alone = false;
  bool single_pass = false;
  bool evaluate = false;
  bool json = false;
  RegistrationLimits limits;
};

absl::StatusOr<v1::RegistrationSpec> SpecOf(const RegisterOptions& options) {
  WEFT_ASSIGN_OR_RETURN(v1::PipelineOptions changes, ChangesOf(options.pipeline, RegistrationStages()));
  v1::RegistrationSpec spec = options.spec;
  spec.mutable_options()->set_write_observations(options.observations);
  spec.mutable_options()->set_frames_alone(options.frames_alone);
  spec.mutable_options()->set_single_pass(options.single_pass);
  *spec.mutable_options()->mutable_pipeline() = OfStages(changes, RegistrationStages());
  spec.set_live_every(options.live_every);
  return spec;
}

// What came of --scans, good or not.
void PrintScans(const v1::Verdict& verdict) {
  for (const v1::VerdictCheck& check : verdict.checks())
    if (absl::StartsWith(check.id(), "register.scan_"))
      std::printf("scans    %s: %s\n", check.name().c_str(), check.value().c_str());
}

absl::Status PrintOutcome(const v1::Job& job, const RegisterOptions& options, bool quiet) {
  if (options.json) {
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(job));
  } else if (quiet) {
    if (job.verdict().grade() > v1::GRADE_GOOD) PrintVerdict(job.verdict());
  } else {
    if (job.has_verdict()) PrintVerdict(job.verdict());
    PrintScans(job.verdict());
    const std::string summary = JobText(job);
    const bool is_told = absl::StartsWith(job.verdict().reason(), summary + ",");
    std::printf("%sresults  %s\nreport   %s/report.html\n",
                is_told ? "" : absl::StrCat(summary, "\n").c_str(), options.spec.out().c_str(),
                options.spec.out().c_str());
  }
  return OutcomeOf(job);
}

// Drift, distortion and the other measures, into the folder of the results.
absl::Status EvaluateOutcome(const RegisterOptions& options, bool quiet) {
  EvaluationRequest request;
  request.result = options.spec.out();
  WEFT_ASSIGN_OR_RETURN(const JobEvaluation evaluation,
                        WithBar("evaluate", quiet, options.limits.threads,
                                [&](const auto& tell) { return EvaluateJob(request, tell); }));
  return WriteEvaluation(options.spec.out(), evaluation);
}

absl::StatusOr<v1::Job> Run(const RegisterOptions& options, const JobRun& run, bool quiet,
                            const std::stop_token& stop) {
  if (options.daemon.server.empty() && options.live_every > 0) {
    return absl::InvalidArgumentError(
        "--live: a daemon follows a take that is being recorded, so it needs --server HOST:PORT");
  }
  return RunJob(run, quiet, stop);
}

// The session of a daemon's take may name what the command line does not.
absl::Status CheckInputsAreGiven(const RegisterOptions& options) {
  if (!options.daemon.server.empty() && absl::StartsWith(options.spec.dump(), kTakePrefix))
    return absl::OkStatus();
  const std::pair<const char*, const std::string&> inputs[] = {{"--rig", options.spec.rig()},
                                                               {"--board", options.spec.board()},
                                                               {"--template", options.spec.garment()}};
  std::vector<std::string> missing;
  for (const auto& [flag, value] : inputs) {
    if (value.empty()) missing.emplace_back(flag);
  }
  if (missing.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(absl::StrJoin(missing, ", "), missing.size() == 1 ? " is" : " are",
                   " required; only a take of a daemon's session (take:ID with --server) knows its own. "
                   "`weft register --help` explains them"));
}

absl::Status Register(const RegisterOptions& options, bool quiet) {
  WEFT_RETURN_IF_ERROR(CheckInputsAreGiven(options));
  absl::StatusOr<v1::RegistrationSpec> spec = SpecOf(options);
  if (spec.ok() && options.daemon.upload) spec = UploadInputs(options.daemon.server, *std::move(spec), quiet);
  if (!spec.ok()) return spec.status();
  const StopOnSignal signals;  // before, Ctrl-C ends the upload, which the same command goes on with
  const JobRun run{*std::move(spec), "register", options.daemon.server, options.daemon.priority,
                   options.limits};
  if (options.daemon.detach) return DetachJob(run);
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, Run(options, run, quiet, signals.token()));
  const bool has_meshes = job.frames().done() + job.frames().degraded() > 0;
  if (options.evaluate && job.state() == v1::JOB_STATE_DONE && has_meshes)
    WEFT_RETURN_IF_ERROR(EvaluateOutcome(options, quiet));
  return PrintOutcome(job, options, quiet);
}

// The order of these functions is that of the help.
void AddRegisterInputs(CLI::App& command, v1::RegistrationSpec& spec) {
  AddRequired(command, "dump DUMP", *spec.mutable_dump(),
              "Folder of images: <frame>/<camera>.png, or cam<camera>/image<frame>.png");
  AddOption(command, "--rig FILE", *spec.mutable_rig(),
            "The cameras, rig.json. A take of a daemon's session knows its own");
  AddOption(command, "--board FILE", *spec.mutable_board(),
            "The printed board, board.json or board.png; as --rig");
  AddOption(command, "--template DIR", *spec.mutable_garment(), "Folder of `weft template import`; as --rig");
  AddRequired(command, "--out DIR", *spec.mutable_out(), "Folder for the results, made where it is missing");
}

void AddRegisterStages(CLI::App& command, RegisterOptions& options) {
  v1::RegistrationOptions& asked = *options.spec.mutable_options();
  AddFramesOption(command, *options.spec.mutable_frames(), "Which frames of the dump, all by default");
  AddMosaicOption(command, *asked.mutable_mosaic());
  AddOption(command, "--preset NAME", *asked.mutable_preset(),
            "best: least error on hidden cloth; paper: weights of the paper", OneOf(PresetNames()));
  AddPipelineFlags(command, options.pipeline);
  command.add_flag("--observations", options.observations, "Write <frame>/observations.csv as well");
  AddOption(command, "--cloud-format FORMAT", *asked.mutable_cloud_format(),
            "pcd: write <frame>/cloud.pcd beside cloud.ply, for programs that use the Point Cloud Library; "
            "ply: cloud.ply alone",
            OneOf({"ply", "pcd"}));
  AddOption(command, "--scans DIR", *asked.mutable_scans(),
            "Folder of scans by any other method, <frame>.ply or <frame>.pcd in mm: evidence for cloth that "
            "the pattern does not show");
  AddOption(command, "--start-from DIR", *asked.mutable_starts(),
            "Results of an earlier registration of this take: cloth that is not seen starts from "
            "<frame>/mesh.ply there instead of from a smooth fill");
}

void AddRegisterPasses(CLI::App& command, RegisterOptions& options) {
  command.add_flag("--frames-alone", options.frames_alone,
                   "No refinement over neighbouring frames, and no bridges over failed ones");
  command.add_flag("--single-pass", options.single_pass,
                   "No second pass: do not search for missed cells where the first mesh predicts them");
  command.add_flag("--evaluate", options.evaluate,
                   "Measure drift, distortion and the rest of `weft evaluate` when the job is done: "
                   "report.html then has them beside the paper's figures. It takes minutes for large "
                   "garments, of which 20 frames are measured. With --server it is done here");
  command.add_flag("--single-look", options.single_pass, "Older spelling of --single-pass")->group("");
  AddOption(command, "--threads N", options.limits.threads, "Threads; 0 takes all cores",
            CLI::Range(0, 1024));
  AddOption(command, "--memory MIB", options.limits.kept_image_mib,
            "Memory for images that wait for the second pass; those beyond are read again. Takes of raw or "
            "PNG images gain by more. Results are the same",
            CLI::Range(0, 1 << 20));
}

void AddRegisterAtDaemon(CLI::App& command, RegisterOptions& options) {
  AddJobAtDaemon(
      command, options.daemon,
      "send DUMP, rig, board and template to the daemon's library first, for a daemon that sees no "
      "folder of this machine. What it has already is not sent again; the same command goes on with "
      "an upload that was stopped");
  command.get_option("--detach")->excludes(command.get_option("--evaluate"));
  AddOption(command, "--live N", options.live_every,
            "With --server, of a take that is being recorded: register every N-th frame set at once, the "
            "newest first. When the take has ended the others follow, and the refinement over neighbours: "
            "the results are those of a registration after the take",
            CLI::Range(1, 1'000'000));
}

}  // namespace

void AddRegisterCommand(CLI::App& app, CommandLine& line) {
  CLI::App* command = AddCommand(
      app, "register",
      "From the images of a dump to registered meshes. Decodes the board in every view, triangulates its "
      "cells, aligns the template, and writes per frame mesh.ply (the template's vertices), cloud.ply and "
      "report.json, and report.html for all. Frames that are complete from an earlier run with the same "
      "inputs are kept, so a stopped run is resumed.",
      "  weft register DUMP --rig rig.json --board board.png --template shirt --out result\n"
      "  weft register DUMP --rig rig.json --board board.png --template shirt --out result --frames 0:10\n"
      "  weft register DUMP --rig rig.json --board board.png --template shirt --out result --server "
      "127.0.0.1:7411\n"
      "  weft register DUMP --rig rig.json --board board.png --template shirt --out result --server "
      "studio:7411 --upload\n"
      "  weft register library:jump --rig library:studio --board library:stripes@2 --template library:shirt "
      "--out result --server studio:7411\n"
      "  weft register DUMP --rig rig.json --board board.png --template shirt --out result --set "
      "triangulation.consensus.inlier_radius_mm=1.5");
  auto options = std::make_shared<RegisterOptions>();
  AddRegisterInputs(*command, options->spec);
  AddRegisterStages(*command, *options);
  AddRegisterPasses(*command, *options);
  AddRegisterAtDaemon(*command, *options);
  command->add_flag("--json", options->json, "Print the job as JSON on standard output");
  command->callback([options, &line] {
    line.writes_remotely = !options->daemon.server.empty();
    line.run = [options, &line] { return Register(*options, line.quiet); };
  });
}

}  // namespace weft
