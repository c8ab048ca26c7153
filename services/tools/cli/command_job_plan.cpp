// weft job plan: what a job will take on a cluster.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/options/presets.h"
#include "services/ground/process/program_beside.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/pipeline_flags.h"
#include "services/tools/cli/progress.h"
#include "services/work/pipeline/output_folder.h"
#include "services/work/plan/job_plan.h"

namespace weft {
namespace {

struct JobPlanOptions {
  v1::RegistrationSpec spec;
  std::string dump, rig, board, garment, frames, mosaic, scratch;
  std::string preset = kDefaultPreset;
  PipelineFlags pipeline;
  PilotOptions pilot;
  PlanRequest request;
  int job_frames = 0;
  bool json = false;
};

absl::StatusOr<v1::RegistrationSpec> SpecToPlan(const JobPlanOptions& options) {
  WEFT_ASSIGN_OR_RETURN(v1::PipelineOptions changes, ChangesOf(options.pipeline, RegistrationStages()));
  v1::RegistrationSpec spec;
  spec.set_dump(options.dump);
  spec.set_rig(options.rig);
  spec.set_board(options.board);
  spec.set_garment(options.garment);
  spec.set_frames(options.frames);
  spec.mutable_options()->set_preset(options.preset);
  spec.mutable_options()->set_mosaic(options.mosaic);
  *spec.mutable_options()->mutable_pipeline() = OfStages(changes, RegistrationStages());
  WEFT_ASSIGN_OR_RETURN(v1::RegistrationOptions effective, EffectiveOptions(spec.options()));
  *spec.mutable_options() = std::move(effective);
  return spec;
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
  const absl::Cleanup remove = [&scratch] {
    std::error_code ignored;
    std::filesystem::remove_all(*scratch, ignored);
  };
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
  if (asked.json) return PrintJsonMessage(plan);
  std::fputs(JobPlanText(plan).c_str(), stdout);
  return absl::OkStatus();
}

void AddClusterOptions(CLI::App& command, PlanRequest& request) {
  command.add_option("--cores", request.cores, "Cores that the job may take")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000));
  command.add_option("--compare", request.other_cores, "Other numbers of cores to predict for")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000));
  command.add_option("--frames-per-task", request.frames_per_task, "Frames of a task; 0 chooses")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--starts-per-s", request.starts_per_s, "Tasks that the scheduler starts a second")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command
      .add_option("--launch-s", request.launch_s,
                  "From the end of a task until the next one runs in its place")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);
  command
      .add_option("--shared-mib-per-s", request.shared_mib_per_s,
                  "What the shared file system gives all tasks together; 0: any")
      ->type_name("MIB")
      ->check(CLI::NonNegativeNumber);
  command
      .add_option("--core-speed", request.core_speed,
                  "Speed of the cluster's cores, relative to those of this machine")
      ->type_name("X")
      ->check(CLI::Range(0.01, 100.0));
  command.add_option("--cores-per-node", request.cores_per_node, "Cores that are lost with a node")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  command
      .add_option("--hours-between-losses", request.hours_between_losses,
                  "Mean time until a node is lost; 0: never")
      ->type_name("H")
      ->check(CLI::NonNegativeNumber);
}

}  // namespace

void AddJobPlanCommand(CLI::App& job, CommandLine& line) {
  CLI::App* command = AddCommand(
      job, "plan",
      "Predict what a job will take on a cluster: core-hours, wall time, memory and bytes, how many frames "
      "a task should have, and what limits. Registers some of its frames on this machine first, whose "
      "results are not kept.",
      "  weft job plan DUMP --rig rig.json --board board.png --template shirt --cores 1000\n"
      "  weft job plan DUMP --rig rig.json --board board.png --template shirt --cores 64 --compare 256 1024 "
      "--shared-mib-per-s 2000");
  auto options = std::make_shared<JobPlanOptions>();
  command->add_option("dump", options->dump, "As of `weft register`")->required()->type_name("DUMP");
  command->add_option("--rig", options->rig, "The cameras, rig.json")->required()->type_name("FILE");
  command->add_option("--board", options->board, "The printed board, board.json or board.png")
      ->required()
      ->type_name("FILE");
  command->add_option("--template", options->garment, "Folder of `weft template import`")
      ->required()
      ->type_name("DIR");
  AddFramesOption(*command, options->frames, "Which frames the job has, all by default");
  AddMosaicOption(*command, options->mosaic);
  command->add_option("--preset", options->preset, "As of `weft register`")
      ->type_name("NAME")
      ->check(OneOf(PresetNames()));
  AddPipelineFlags(*command, options->pipeline);
  command->add_option("--pilot", options->pilot.frames, "Frames to register")
      ->type_name("N")
      ->check(CLI::Range(1, 10'000));
  command
      ->add_option("--job-frames", options->job_frames,
                   "Plan for so many frames like those of DUMP; 0: for those that it has")
      ->type_name("N")
      ->check(CLI::Range(0, 100'000'000));
  command->add_option("--cpus-per-task", options->pilot.threads, "Threads of a task")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("--at-once", options->pilot.at_once,
                   "Workers of the pilot that run at once. As many as a node will run share its memory as "
                   "they will")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("--scratch", options->scratch,
                   "Folder for the results of the pilot; best where the job's will lie, for their speed")
      ->type_name("DIR");
  AddClusterOptions(*command, options->request);
  command->add_flag("--json", options->json, "Print JSON (weft.v1.JobPlan)");
  command->callback(
      [options, &line] { line.run = [options, &line] { return PlanJobOf(*options, line.quiet); }; });
}

}  // namespace weft
