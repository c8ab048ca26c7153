#include "services/tools/cli/evaluate_avatar.h"

#include <filesystem>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/command_line.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/progress.h"
#include "services/work/animation/avatar_text.h"

namespace weft {
namespace {

// What the avatar is driven over and by, and how it is looked at.
std::vector<CLI::Option*> AddDrivingOptions(CLI::App& command, EvaluateAvatarOptions& options) {
  AvatarScoring& scoring = options.scoring;
  return {
      AddOption(
          command, "--baseline DIR", scoring.baseline,
          "Drive this avatar of `weft avatar train --preset paper` by the same observations, where there "
          "are two cameras"),
      AddOption(
          command, "--cameras N,N", scoring.cameras,
          "Numbers of cameras, each measured by itself. Without pictures they stand around the garment, "
          "at equal angles; with pictures they are chosen among those of the take",
          CLI::Range(1, 1000))
          ->delimiter(',')
          ->allow_extra_args(false),
      AddOption(
          command, "--splits NAME,NAME", scoring.splits,
          "Which takes of a data set: validate, test-known, test-unseen. What is chosen by a test is no "
          "test any more: compare avatars by validate",
          OneOf({"train", "validate", "test-known", "test-unseen"}))
          ->delimiter(',')
          ->allow_extra_args(false),
      AddOption(command, "--frames RANGE", options.frames,
                "Which frames of each take, all by default: a range A:B by position, B not included, either "
                "side may be left out; or N, the first N alone"),
      command.add_flag("--pictures", scoring.films,
                       "Render and decode pictures of takes without them, instead of imitating the decoder: "
                       "about half a second of a core a picture. What imitation gives stands beside it"),
      command.add_flag("--trials", scoring.with_trials,
                       "Drive takes without pictures also before two cameras in other places, each frame by "
                       "itself, and while one of two is dark"),
      AddOption(command, "--meshes DIR", scoring.meshes,
                "Write driven and true meshes of each frame below this folder, to be watched side by side")};
}

}  // namespace

void AddEvaluateAvatarOptions(CLI::App& command, EvaluateAvatarOptions& options) {
  constexpr char kGroup[] = "An avatar";
  CLI::Option* avatar =
      AddOption(command, "--avatar DIR", options.scoring.avatar,
                "Drive this avatar (`weft avatar train`) over RESULT, which is then a data set or a take of "
                "`weft simulate`, with or without pictures, and compare it with the truth")
          ->group(kGroup);
  for (CLI::Option* option : AddDrivingOptions(command, options)) option->needs(avatar)->group(kGroup);
}

absl::StatusOr<FrameRange> ParseScoredFrames(const std::string& text) {
  FrameRange range = {0, SIZE_MAX};
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  if (text.empty() || text == "0") return range;
  if (parts.size() == 1 && absl::SimpleAtoi(text, &range.end)) return range;
  const bool fits = parts.size() == 2 && (parts[0].empty() || absl::SimpleAtoi(parts[0], &range.first)) &&
                    (parts[1].empty() || absl::SimpleAtoi(parts[1], &range.end)) && range.first < range.end;
  if (fits) return range;
  return absl::InvalidArgumentError(
      absl::StrCat("--frames ", text,
                   ": expected A:B, positions of the first frame and of the first one after the range, or "
                   "the number of frames from the first on"));
}

absl::Status EvaluateAvatar(const EvaluateAvatarOptions& options, bool quiet) {
  AvatarScoring scoring = options.scoring;
  WEFT_ASSIGN_OR_RETURN(scoring.frames, ParseScoredFrames(options.frames));
  const StopOnSignal signals;  // before the first thread
  WEFT_ASSIGN_OR_RETURN(const v1::AvatarEvaluation evaluation,
                        WithBar("drive", quiet, 0, [&](const auto& tell) {
                          return ScoreAvatar(scoring, tell, signals.token());
                        }));
  if (!options.out.empty()) {
    const std::string path = (std::filesystem::path(options.out) / "avatar-evaluation.json").string();
    WEFT_RETURN_IF_ERROR(CreateFolders(options.out));
    WEFT_RETURN_IF_ERROR(WriteJsonFile(path, evaluation));
  }
  return PrintMessage(evaluation, options.json, AvatarEvaluationText(evaluation));
}

}  // namespace weft
