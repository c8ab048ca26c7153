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
#include "services/animation/train_avatar.h"
#include "services/cli/commands.h"
#include "services/cli/json_output.h"
#include "services/cli/progress.h"
#include "services/process/exit_status.h"
#include "services/process/stop_on_signal.h"

namespace weft {
namespace {

struct TrainOptions {
  AvatarRequest request;
  int threads = 0;
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
  AddAvatarDriveCommand(*avatar, line);
  AddShowCommand(*avatar, line);
}

}  // namespace weft
