// `weft evaluate SOURCE --avatar AVATAR`: a garment's avatar against the truth.
#pragma once

#include <CLI/CLI.hpp>

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/take/frame_range.h"
#include "services/work/animation/score_avatar.h"

namespace weft {

struct EvaluateAvatarOptions {
  AvatarScoring scoring;  // avatar is empty where no avatar is evaluated
  std::string frames;     // as ParseScoredFrames reads it
  std::string out;        // folder for avatar-evaluation.json; empty: none
  bool json = false;
};

// What --frames says: A:B, positions in each take without the last one, or the number of frames from the
// first on; 0 and an empty text are all. InvalidArgument.
absl::StatusOr<FrameRange> ParseScoredFrames(const std::string& text);

// --avatar, and what goes with it alone.
void AddEvaluateAvatarOptions(CLI::App& command, EvaluateAvatarOptions& options);

// Prints the table, or JSON.
absl::Status EvaluateAvatar(const EvaluateAvatarOptions& options, bool quiet);

}  // namespace weft
