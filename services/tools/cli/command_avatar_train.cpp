// weft avatar train: from meshes of a worn garment to its avatar.
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <cstdio>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/stopwatch.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/net_trainer.h"
#include "services/tools/cli/progress.h"
#include "services/work/animation/avatar_text.h"
#include "services/work/animation/train_avatar.h"
#include "services/work/animation/train_pixel_avatar.h"

namespace weft {
namespace {

struct TrainOptions {
  std::string preset;  // empty: our own way
  AvatarRequest request;
  bool has_net = false;
  NetRequest net;
  int threads = 0;
  bool json = false;
};

// A bar for each stage, and a line where a net was tried on frames that were held out.
class TrainingView {
 public:
  explicit TrainingView(bool quiet) : quiet_(quiet), bars_(quiet) {}

  void Show(std::string_view stage, double share) { bars_.SetShare(std::string(stage), share); }
  void Show(const v1::NetTrainingProgress& now, const char* stage) {
    Show(stage, now.share());
    if (quiet_ || now.held_out().empty()) return;
    std::string line = absl::StrFormat("%s  step %d, %.0f min, held out:", stage, now.step(), now.minutes());
    for (const v1::AvatarNetGain& gain : now.held_out())
      absl::StrAppendFormat(&line, "  %s%.3f mm, %.3f with it",
                            gain.cameras() > 0 ? absl::StrCat(gain.cameras(), " cameras ") : "",
                            gain.before_mm(), gain.after_mm());
    bars_.PrintLine(line);
  }

 private:
  const bool quiet_;
  StageBars bars_;
};

NetTrainer TrainerThatShows(TrainingView& view) {
  return [&view](const NetTask& task, const std::stop_token& stop) {
    const char* stage = task.kind == NetKind::kPrior ? "prior" : "net";
    return RunNetTrainer(
        task, [&view, stage](const v1::NetTrainingProgress& now) { view.Show(now, stage); }, stop);
  };
}

absl::Status PrintTrained(const TrainOptions& options, const v1::Avatar& about, const Stopwatch& watch) {
  if (options.json) return PrintJsonMessage(about);
  std::fputs(AvatarText(options.request.out, about).c_str(), stdout);
  std::printf("trained in %.1f s\n", watch.Seconds());
  return absl::OkStatus();
}

// As Halimi et al. 2022.
absl::Status TrainPaper(const TrainOptions& options, int threads, bool quiet) {
  WEFT_RETURN_IF_ERROR(CheckNetTrainer());
  const StopOnSignal signals;  // before the first thread
  const Stopwatch watch;
  const AvatarRequest& given = options.request;
  PixelAvatarRequest request;
  request.sources = given.sources, request.held_out = given.held_out, request.garment = given.garment;
  request.fps = given.fps, request.out = given.out, request.seed = given.training.seed;
  request.samples.atlas.level = 0;  // as fine as the mesh
  request.steps = options.net.steps, request.hours = options.net.hours;
  request.keep = options.net.keep, request.threads = threads;
  absl::StatusOr<PixelAvatarFile> avatar;
  {
    TrainingView view(quiet);
    request.trainer = TrainerThatShows(view);
    avatar = TrainPixelAvatar(
        request, [&view](std::string_view stage, double share) { view.Show(stage, share); }, signals.token());
  }
  if (!avatar.ok()) return avatar.status();
  return PrintTrained(options, avatar->about, watch);
}

absl::Status Train(const TrainOptions& options, bool quiet) {
  const int threads = options.threads > 0 ? options.threads : tbb::info::default_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  if (options.preset == kPixelKind) return TrainPaper(options, threads, quiet);
  const StopOnSignal signals;  // before the first thread
  const Stopwatch watch;
  absl::StatusOr<TrainedAvatar> avatar;
  {
    TrainingView view(quiet);
    AvatarRequest request = options.request;
    if (options.has_net) {
      WEFT_RETURN_IF_ERROR(CheckNetTrainer());
      request.net = options.net;
      request.net->threads = threads;
      request.net->trainer = TrainerThatShows(view);
    }
    avatar = TrainAvatar(
        request, [&view](std::string_view stage, double share) { view.Show(stage, share); }, signals.token());
  }
  if (!avatar.ok()) return avatar.status();
  if (!quiet && !avatar->net_remark.empty()) PrintWarning(avatar->net_remark);
  return PrintTrained(options, avatar->file.about, watch);
}

// The order of these functions is that of the help.
void AddTrainSources(CLI::App& command, AvatarRequest& request) {
  AddRequired(command, "sources DIR", request.sources, "Results, simulated takes or data sets to learn from");
  AddRequired(command, "--out DIR", request.out, "The avatar's folder; an avatar that is there is replaced");
  AddOption(command, "--hold-out DIR", request.held_out,
            "A source that is not learnt from and tells how far the avatar is to be trusted; may be repeated")
      ->allow_extra_args(false);
  AddOption(command, "--template DIR", request.garment,
            "Folder of the template; by default that of the first source");
  AddOption(command, "--components N", request.training.components,
            "Shapes that the garment is a mixture of; size and time grow with them", CLI::Range(1, 1000));
  AddOption(command, "--max-frames N", request.training.max_frames,
            "Frames to learn from at most, evenly chosen where there are more", CLI::Range(10, 1'000'000));
  AddOption(command, "--fps N", request.fps,
            "Frames per second of results whose take tells no times; 0 for 30", CLI::NonNegativeNumber);
  AddOption(command, "--seed N", request.training.seed,
            "Of the choice of frames and of the algebra; of a net's samples, weights and their order");
}

void AddTrainNet(CLI::App& command, TrainOptions& options) {
  CLI::Option* net = command.add_flag(
      "--net", options.has_net,
      "Train a net that says how far driven meshes are off, by the program weft-train; hours, where the rest "
      "takes minutes. Its samples and state lie in OUT.training until the avatar is whole: Ctrl-C stops it, "
      "and the same command goes on. A net that brings held-out frames no nearer to the truth is left out");
  CLI::Option* preset =
      AddOption(command, "--preset NAME", options.preset,
                "paper: learn as Halimi et al. 2022 do, a deformation graph with a prior and a net for two "
                "fixed cameras, to be compared with by `weft evaluate --baseline`. It needs weft-train, and "
                "takes without pictures whose rig.json has two cameras",
                OneOf({kPixelKind}))
          ->excludes(net);
  for (const char* of_shapes : {"--components", "--max-frames"})
    preset->excludes(command.get_option(of_shapes));
  AddOption(command, "--steps N", options.net.steps,
            "Of a net, or with --preset: how many batches of frames the net learns from; a prior takes half "
            "as many",
            CLI::Range(1, 100'000'000));
  AddOption(command, "--hours H", options.net.hours,
            "Of a net, or with --preset: the net's training ends after these at the latest, however many "
            "steps it has done. What comes out then depends on how fast the machine is",
            CLI::PositiveNumber);
  command.add_flag("--keep", options.net.keep,
                   "Of a net, or with --preset: keep OUT.training, for a look at the samples");
}

}  // namespace

void AddAvatarTrainCommand(CLI::App& avatar, CommandLine& line) {
  CLI::App* command = AddCommand(
      avatar, "train",
      "Learn what a garment does while it is worn, from complete meshes of it: results of `weft register`, "
      "takes of `weft simulate`, data sets of `weft dataset make`. Learnt are the shapes that it takes, how "
      "they follow each other, how its threads stretch, and, by frames that are held out, how far all that "
      "is to be trusted. The more kinds of motion there are, the better it follows one that it never saw; "
      "minutes of each are enough. Of data sets the split train is learnt from and validate held out. Of "
      "other sources the last tenth is held out, unless --hold-out names takes.",
      "  weft avatar train walk/result jog/result reach/result --out shirt.avatar\n"
      "  weft avatar train shirt-drive --out shirt.avatar\n"
      "  weft avatar train shirt-drive --net --out shirt.avatar\n"
      "  weft avatar train shirt-drive --preset paper --out paper.avatar\n"
      "  weft avatar train walk jog --hold-out twist --components 32 --out shirt.avatar");
  auto options = std::make_shared<TrainOptions>();
  AddTrainSources(*command, options->request);
  AddTrainNet(*command, *options);
  AddOption(*command, "--threads N", options->threads,
            "Threads; 0 takes all cores. The weights of a net depend on their number, nothing else does",
            CLI::Range(0, 1024));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.Avatar)");
  command->callback([command, options, &line] {
    for (const char* of_net : {"--steps", "--hours", "--keep"})
      if (command->count(of_net) > 0 && !options->has_net && options->preset.empty())
        throw CLI::RequiresError(of_net, "--net");
    line.run = [options, &line] { return Train(*options, line.quiet); };
  });
}

}  // namespace weft
