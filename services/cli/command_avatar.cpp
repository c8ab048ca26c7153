// weft avatar: what a garment was captured doing, so that a few cameras suffice to follow it.
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/stopwatch.h"
#include "services/animation/avatar_file.h"
#include "services/animation/avatar_goals.h"
#include "services/animation/drive_take.h"
#include "services/animation/train_avatar.h"
#include "services/cli/absolute_paths.h"
#include "services/cli/commands.h"
#include "services/cli/input_options.h"
#include "services/cli/job_view.h"
#include "services/cli/json_output.h"
#include "services/cli/pipeline_flags.h"
#include "services/cli/print_verdict.h"
#include "services/cli/progress.h"
#include "services/options/presets.h"
#include "services/process/exit_status.h"
#include "services/process/stop_on_signal.h"

namespace weft {
namespace {

struct TrainOptions {
  AvatarRequest request;
  int threads = 0;
  bool json = false;
};

struct DriveOptions {
  DriveRequest request;
  std::string dump, rig, board, garment, out, frames, mosaic;
  PipelineFlags pipeline;
  bool json = false;
};

absl::Status Train(const TrainOptions& options, bool quiet) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  options.threads > 0
                                      ? static_cast<size_t>(options.threads)
                                      : static_cast<size_t>(tbb::info::default_concurrency()));
  const StopOnSignal signals;  // before the first thread
  const Stopwatch watch;
  const bool visible = ProgressVisible(quiet);
  absl::StatusOr<AvatarFile> avatar;
  {
    constexpr uint64_t kSteps = 1000;
    std::string stage_shown;
    std::optional<Progress> progress;
    avatar = TrainAvatar(
        options.request,
        [&](std::string_view stage, double share) {
          if (stage_shown != stage) {
            stage_shown = stage;
            progress.reset();
            progress.emplace(stage_shown, kSteps, visible, ProgressUnit::kPercent);
          }
          progress->Set(static_cast<uint64_t>(share * kSteps), kSteps);
        },
        signals.token());
  }
  if (!avatar.ok()) return avatar.status();
  if (options.json) return PrintJsonMessage(avatar->about);
  std::fputs(AvatarText(options.request.out, avatar->about).c_str(), stdout);
  std::printf("trained in %.1f s\n", watch.Seconds());
  return absl::OkStatus();
}

absl::StatusOr<DriveRequest> DriveRequestOf(const DriveOptions& options) {
  const absl::StatusOr<CommandPipeline> pipeline =
      MakeCommandPipeline(kDefaultPreset, options.pipeline, {"decode"});
  if (!pipeline.ok()) return pipeline.status();
  DriveRequest request = options.request;
  v1::RegistrationSpec spec;
  spec.set_dump(options.dump);
  spec.set_rig(options.rig);
  spec.set_board(options.board);
  spec.set_garment(options.garment);
  spec.set_out(options.out);
  spec.set_frames(options.frames);
  spec.mutable_options()->set_preset(kDefaultPreset);
  spec.mutable_options()->set_mosaic(options.mosaic);
  spec.mutable_options()->set_frames_alone(true);
  spec.mutable_options()->set_single_pass(true);
  spec.mutable_options()->set_write_observations(options.request.write_observations);
  *spec.mutable_options()->mutable_pipeline() = pipeline->message;
  request.spec = WithAbsolutePaths(std::move(spec));
  request.avatar = options.request.avatar.empty() ? "" : AbsolutePath(options.request.avatar);
  request.decode = pipeline->options.decode;
  return request;
}

absl::Status Drive(const DriveOptions& options, bool quiet) {
  const absl::StatusOr<DriveRequest> request = DriveRequestOf(options);
  if (!request.ok()) return request.status();
  const StopOnSignal signals;  // before the first thread
  absl::StatusOr<v1::Job> job;
  {
    Progress progress("drive", 1, ProgressVisible(quiet));
    job = DriveTake(
        *request,
        [&](size_t done, size_t all, const v1::FrameInfo& info) {
          progress.Set(done, all);
          if (info.state() == v1::FRAME_STATE_FAILED && !quiet) progress.PrintLine(FrameLine(info));
        },
        signals.token());
  }
  if (!job.ok()) return job.status();
  if (!quiet)
    for (const std::string& warning : job->warnings()) PrintWarning(warning);
  if (options.json) {
    if (absl::Status status = PrintJsonMessage(*job); !status.ok()) return status;
  } else {
    if (job->has_verdict()) PrintVerdict(job->verdict());
    std::printf("results  %s\nreport   %s/report.html\n", options.out.c_str(), options.out.c_str());
  }
  return OutcomeOf(*job);
}

void AddTrainCommand(CLI::App& avatar, CommandLine& line) {
  CLI::App* command =
      AddCommand(avatar, "train",
                 "Learn what a garment does while it is worn, from complete meshes of it: results of `weft "
                 "register`, takes of "
                 "`weft simulate`, data sets of `weft dataset make`. Learnt are the shapes that it takes, "
                 "how they follow each "
                 "other, how its threads stretch, and, by frames that are held out, how far all that is to "
                 "be trusted. The "
                 "more kinds of motion there are, the better it follows one that it never saw; minutes of "
                 "each are enough. Of "
                 "data sets the split train is learnt from and validate held out. Of other sources the last "
                 "tenth is held "
                 "out, unless --hold-out names takes.",
                 "  weft avatar train walk/result jog/result reach/result --out shirt.avatar\n"
                 "  weft avatar train shirt-drive --out shirt.avatar\n"
                 "  weft avatar train walk jog --hold-out twist --components 32 --out shirt.avatar");
  auto options = std::make_shared<TrainOptions>();
  AvatarRequest& request = options->request;
  command->add_option("sources", request.sources, "Results, simulated takes or data sets to learn from")
      ->required()
      ->type_name("DIR");
  command->add_option("--out", request.out, "The avatar's folder; an avatar that is there is replaced")
      ->required()
      ->type_name("DIR");
  command
      ->add_option(
          "--hold-out", request.held_out,
          "A source that is not learnt from and tells how far the avatar is to be trusted; may be repeated")
      ->type_name("DIR")
      ->allow_extra_args(false);
  command
      ->add_option("--template", request.garment,
                   "Folder of the template; by default that of the first source")
      ->type_name("DIR");
  command
      ->add_option("--components", request.training.components,
                   "Shapes that the garment is a mixture of; size and time grow with them")
      ->type_name("N")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--max-frames", request.training.max_frames,
                   "Frames to learn from at most, evenly chosen where there are more")
      ->type_name("N")
      ->check(CLI::Range(10, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--fps", request.fps, "Frames per second of results whose take tells no times; 0 for 30")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--seed", request.training.seed, "Of the choice of frames and of the algebra")
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--threads", options->threads, "Threads; 0 takes all cores")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.Avatar)");
  command->callback(
      [options, &line] { line.run = [options, &line] { return Train(*options, line.quiet); }; });
}

void AddDriveCommand(CLI::App& avatar, CommandLine& line) {
  CLI::App* command = AddCommand(avatar, "drive",
                                 "Follow a garment that was captured before with two or three cameras: its "
                                 "avatar supplies what they do not "
                                 "see. Any number of calibrated cameras at any place will do; three at equal "
                                 "angles are much better than two. "
                                 "Results are those of a registration, so `weft evaluate` and `weft export` "
                                 "work on them; sigma_mm tells how "
                                 "far each vertex is to be trusted. Frames are driven in order, since each "
                                 "starts from the one before. A "
                                 "stopped run is resumed by the same command: complete frames stay, and are "
                                 "driven again only for the tracker "
                                 "to know them. A frame that shows too little of the garment fails, and the "
                                 "garment is looked for anew in the "
                                 "next one.",
                                 "  weft avatar drive DUMP --avatar shirt.avatar --rig rig.json --board "
                                 "board.json --template shirt --out result\n"
                                 "  weft avatar drive DUMP --avatar shirt.avatar --rig rig.json --board "
                                 "board.json --template shirt --out result "
                                 "--cameras front,back,left");
  auto options = std::make_shared<DriveOptions>();
  command->add_option("dump", options->dump, "Folder of images, or a recorded take")
      ->required()
      ->type_name("DUMP");
  command->add_option("--avatar", options->request.avatar, "The garment's avatar, of `weft avatar train`")
      ->required()
      ->type_name("DIR");
  command->add_option("--rig", options->rig, "The cameras, rig.json")->required()->type_name("FILE");
  command->add_option("--board", options->board, "The printed board, board.json or board.png")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--template", options->garment, "Folder of the template that the avatar was trained with")
      ->required()
      ->type_name("DIR");
  command->add_option("--out", options->out, "Folder for the results, made where it is missing")
      ->required()
      ->type_name("DIR");
  command->add_option("--cameras", options->request.cameras, "Use these cameras of the rig alone, by name")
      ->type_name("NAME,NAME")
      ->delimiter(',')
      ->allow_extra_args(false);
  AddFramesOption(*command, options->frames, "Which frames of the dump, all by default");
  AddMosaicOption(*command, options->mosaic);
  AddPipelineFlags(*command, options->pipeline);
  command->add_flag("--observations", options->request.write_observations,
                    "Write <frame>/observations.csv as well");
  command
      ->add_option("--fps", options->request.fps,
                   "Frames per second of a dump that tells no times; 0 for those of the avatar")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--threads", options->request.threads, "Threads; 0 takes all cores")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command->add_flag("--json", options->json, "Print the job as JSON on standard output");
  command->callback(
      [options, &line] { line.run = [options, &line] { return Drive(*options, line.quiet); }; });
}

void AddShowCommand(CLI::App& avatar, CommandLine& line) {
  CLI::App* command = AddCommand(avatar, "show",
                                 "Tell what an avatar was trained on, how large it is, and how well it "
                                 "explains frames that it did not learn "
                                 "from. Checks its files on the way.",
                                 "  weft avatar show shirt.avatar");
  struct ShowOptions {
    std::string path;
    bool json = false;
  };
  auto options = std::make_shared<ShowOptions>();
  command->add_option("avatar", options->path, "The avatar's folder")->required()->type_name("DIR");
  command->add_flag("--json", options->json, "Print JSON (weft.v1.Avatar)");
  command->callback([options, &line] {
    line.run = [options]() -> absl::Status {
      const absl::StatusOr<AvatarFile> avatar_file = ReadAvatar(options->path);
      if (!avatar_file.ok()) return avatar_file.status();
      if (options->json) return PrintJsonMessage(avatar_file->about);
      std::fputs(AvatarText(options->path, avatar_file->about).c_str(), stdout);
      return absl::OkStatus();
    };
  });
}

}  // namespace

void AddAvatarCommand(CLI::App& app, CommandLine& line) {
  CLI::App* avatar = AddCommand(
      app, "avatar",
      "Garments that were captured before: learn what they do, and follow them with two or three cameras.",
      "  weft avatar train walk/result jog/result --out shirt.avatar\n"
      "  weft avatar drive DUMP --avatar shirt.avatar --rig rig.json --board board.json --template shirt "
      "--out result\n"
      "  weft evaluate shirt-drive --avatar shirt.avatar");
  avatar->require_subcommand(1);
  AddTrainCommand(*avatar, line);
  AddDriveCommand(*avatar, line);
  AddShowCommand(*avatar, line);
}

}  // namespace weft
