// weft job plan: what a job will take on a cluster.
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "services/formats/options/presets.h"
#include "services/ground/process/program_beside.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/pipeline_flags.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/upload_inputs.h"
#include "services/work/plan/job_plan.h"

namespace weft {
namespace {

struct JobPlanOptions {
  JobPlanOptions() { spec.mutable_options()->set_preset(kDefaultPreset); }

  v1::RegistrationSpec spec;  // its paths, its frames, and all texts of its options
  std::string scratch;
  PipelineFlags pipeline;
  PilotOptions pilot;
  PlanRequest request;
  int job_frames = 0;
  bool json = false;
};

absl::StatusOr<v1::RegistrationSpec> SpecToPlan(const JobPlanOptions& options) {
  WEFT_ASSIGN_OR_RETURN(v1::PipelineOptions changes, ChangesOf(options.pipeline, RegistrationStages()));
  v1::RegistrationSpec spec = options.spec;
  *spec.mutable_options()->mutable_pipeline() = OfStages(changes, RegistrationStages());
  WEFT_ASSIGN_OR_RETURN(*spec.mutable_options(), EffectiveOptions(spec.options()));
  return WithAbsolutePaths(std::move(spec));
}

// A new folder for the results of the pilot.
absl::StatusOr<std::string> MakeScratch(const std::string& parent) {
  std::error_code error;
  const std::filesystem::path base =
      parent.empty() ? std::filesystem::temp_directory_path(error) : std::filesystem::path(parent);
  std::string name = (base / "weft-plan.XXXXXX").string();
  if (error || mkdtemp(name.data()) == nullptr)
    return absl::UnavailableError(
        absl::StrCat(base.string(), ": no folder can be made there; --scratch DIR gives another place"));
  return std::filesystem::canonical(name).string();
}

absl::Status PlanJobOf(const JobPlanOptions& asked, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(v1::RegistrationSpec spec, SpecToPlan(asked));
  WEFT_RETURN_IF_ERROR(asked.request.Validate());
  const absl::StatusOr<std::string> scratch = MakeScratch(asked.scratch);
  if (!scratch.ok()) return scratch.status();
  const absl::Cleanup remove = [&scratch] { RemoveTree(*scratch); };
  const StopOnSignal signals;
  PilotOptions options = asked.pilot;
  options.out = *scratch;
  options.worker_program = ProgramBeside("weft-worker");
  absl::StatusOr<Pilot> pilot;
  {
    Progress progress("pilot", static_cast<uint64_t>(options.frames), ProgressVisible(quiet));
    options.progress = [&progress](size_t done, size_t all) { progress.Set(done, all); };
    pilot = RunPilot(spec, options, signals.token());
  }
  if (!pilot.ok()) return pilot.status();
  if (asked.job_frames > 0) pilot->job_frames = asked.job_frames;
  WEFT_ASSIGN_OR_RETURN(const v1::JobPlan plan, PlanJob(*pilot, asked.request));
  return PrintMessage(plan, asked.json, JobPlanText(plan));
}

void AddClusterOptions(CLI::App& command, PlanRequest& request) {
  AddOption(command, "--cores N", request.cores, "Cores that the job may take", CLI::Range(1, 1'000'000));
  AddOption(command, "--compare N", request.other_cores, "Other numbers of cores to predict for",
            CLI::Range(1, 1'000'000));
  AddOption(command, "--frames-per-task N", request.frames_per_task, "Frames of a task; 0 chooses",
            CLI::NonNegativeNumber);
  AddOption(command, "--starts-per-s N", request.starts_per_s, "Tasks that the scheduler starts a second",
            CLI::PositiveNumber);
  AddOption(command, "--launch-s S", request.launch_s,
            "From the end of a task until the next one runs in its place", CLI::NonNegativeNumber);
  AddOption(command, "--shared-mib-per-s MIB", request.shared_mib_per_s,
            "What the shared file system gives all tasks together; 0: any", CLI::NonNegativeNumber);
  AddOption(command, "--core-speed X", request.core_speed,
            "Speed of the cluster's cores, relative to those of this machine", CLI::Range(0.01, 100.0));
  AddOption(command, "--cores-per-node N", request.cores_per_node, "Cores that are lost with a node",
            CLI::Range(1, 1024));
  AddOption(command, "--hours-between-losses H", request.hours_between_losses,
            "Mean time until a node is lost; 0: never", CLI::NonNegativeNumber);
}

}  // namespace

void AddJobPlanCommand(CLI::App& job, CommandLine& line) {
  const auto [command, options] = AddCommand<JobPlanOptions>(
      job, line, PlanJobOf, "plan",
      "Predict what a job will take on a cluster: core-hours, wall time, memory and bytes, how "
      "many frames a task should have, and what limits. Registers some of its frames on this "
      "machine first, whose results are not kept.",
      "  weft job plan DUMP --rig rig.json --board board.png --template shirt --cores 1000\n"
      "  weft job plan DUMP --rig rig.json --board board.png --template shirt --cores 64 "
      "--compare 256 1024 --shared-mib-per-s 2000");
  v1::RegistrationSpec& spec = options->spec;
  AddRequired(*command, "dump DUMP", *spec.mutable_dump(), "As of `weft register`");
  AddRequired(*command, "--rig FILE", *spec.mutable_rig(), "The cameras, rig.json");
  AddRequired(*command, "--board FILE", *spec.mutable_board(), "The printed board, board.json or board.png");
  AddRequired(*command, "--template DIR", *spec.mutable_garment(), "Folder of `weft template import`");
  AddFramesOption(*command, *spec.mutable_frames(), "Which frames the job has, all by default");
  AddMosaicOption(*command, *spec.mutable_options()->mutable_mosaic());
  AddOption(*command, "--preset NAME", *spec.mutable_options()->mutable_preset(), "As of `weft register`",
            OneOf(PresetNames()));
  AddPipelineFlags(*command, options->pipeline);
  AddOption(*command, "--pilot N", options->pilot.frames, "Frames to register", CLI::Range(1, 10'000));
  AddOption(*command, "--job-frames N", options->job_frames,
            "Plan for so many frames like those of DUMP; 0: for those that it has",
            CLI::Range(0, 100'000'000));
  AddOption(*command, "--cpus-per-task N", options->pilot.threads, "Threads of a task", CLI::Range(1, 1024));
  AddOption(*command, "--at-once N", options->pilot.at_once,
            "Workers of the pilot that run at once. As many as a node will run share its memory as they will",
            CLI::Range(1, 1024));
  AddOption(*command, "--scratch DIR", options->scratch,
            "Folder for the results of the pilot; best where the job's will lie, for their speed");
  AddClusterOptions(*command, options->request);
  command->add_flag("--json", options->json, "Print JSON (weft.v1.JobPlan)");
}

}  // namespace weft
