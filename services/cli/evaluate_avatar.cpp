#include "services/cli/evaluate_avatar.h"

#include <cstdio>
#include <filesystem>

#include "services/animation/avatar_goals.h"
#include "services/cli/json_output.h"
#include "services/cli/progress.h"
#include "services/files/atomic_file.h"
#include "services/files/json_file.h"
#include "services/process/stop_on_signal.h"

namespace weft {

void AddEvaluateAvatarOptions(CLI::App& command, EvaluateAvatarOptions& options) {
  constexpr char kGroup[] = "An avatar";
  CLI::Option* avatar =
      command
          .add_option(
              "--avatar", options.scoring.avatar,
              "Drive this avatar (`weft avatar train`) over RESULT, which is then a data set or a take of "
              "`weft simulate`, with or without pictures, and compare it with the truth")
          ->type_name("DIR")
          ->group(kGroup);
  command
      .add_option(
          "--baseline", options.scoring.baseline,
          "Drive this avatar of `weft avatar train --preset paper` by the same observations, where there are "
          "two cameras")
      ->type_name("DIR")
      ->needs(avatar)
      ->group(kGroup);
  command
      .add_option(
          "--cameras", options.scoring.cameras,
          "Numbers of cameras, each measured by itself. Without pictures they stand around the garment, at "
          "equal angles; with pictures they are chosen among those of the take")
      ->type_name("N,N")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::Range(1, 1000))
      ->capture_default_str()
      ->needs(avatar)
      ->group(kGroup);
  command
      .add_option(
          "--splits", options.scoring.splits,
          "Which takes of a data set: validate, test-known, test-unseen. What is chosen by a test is no "
          "test any more: compare avatars by validate")
      ->type_name("NAME,NAME")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(OneOf({"train", "validate", "test-known", "test-unseen"}))
      ->capture_default_str()
      ->needs(avatar)
      ->group(kGroup);
  command
      .add_option("--frames", options.scoring.max_frames, "The first frames of each take alone; 0 for all")
      ->type_name("N")
      ->check(CLI::Range(0, 1'000'000))
      ->needs(avatar)
      ->group(kGroup);
  command
      .add_flag("--pictures", options.scoring.films,
                "Render and decode pictures of takes without them, instead of imitating the decoder: about "
                "half a second of a core a picture. What imitation gives stands beside it")
      ->needs(avatar)
      ->group(kGroup);
  command
      .add_flag(
          "--trials", options.scoring.with_trials,
          "Drive takes without pictures also before two cameras in other places, each frame by itself, and "
          "while one of two is dark")
      ->needs(avatar)
      ->group(kGroup);
  command
      .add_option("--meshes", options.scoring.meshes,
                  "Write driven and true meshes of each frame below this folder, to be watched side by side")
      ->type_name("DIR")
      ->needs(avatar)
      ->group(kGroup);
  command.add_flag("--check", options.check, "Exit status 1 where a goal of the table is missed")
      ->needs(avatar)
      ->group(kGroup);
}

absl::Status EvaluateAvatar(const EvaluateAvatarOptions& options, bool quiet) {
  const StopOnSignal signals;  // before the first thread
  absl::StatusOr<v1::AvatarEvaluation> evaluation;
  {
    Progress progress("drive", 1, ProgressVisible(quiet));
    evaluation = ScoreAvatar(
        options.scoring, [&progress](size_t done, size_t all) { progress.Set(done, all); }, signals.token());
  }
  if (!evaluation.ok()) return evaluation.status();
  if (!options.out.empty()) {
    const std::string path = (std::filesystem::path(options.out) / "avatar-evaluation.json").string();
    absl::Status status = CreateFolders(options.out);
    if (status.ok()) status = WriteJsonFile(path, *evaluation);
    if (!status.ok()) return status;
  }
  if (options.json) {
    if (absl::Status status = PrintJsonMessage(*evaluation); !status.ok()) return status;
  } else {
    std::fputs(AvatarEvaluationText(*evaluation).c_str(), stdout);
  }
  return options.check ? GoalsStatus(*evaluation) : absl::OkStatus();
}

}  // namespace weft
