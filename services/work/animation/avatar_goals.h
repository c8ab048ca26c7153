// The acceptance table of sparse-view driving, and how it is printed.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "weft/v1/avatar.pb.h"

namespace weft {

// Fills in goals, from the scores that are there: those of the splits test-known and test-unseen of data
// sets, and the size of the avatar.
void AddAvatarGoals(const v1::Avatar& avatar, v1::AvatarEvaluation& evaluation);

// Scores, chaos floor, goals and remarks as tables.
std::string AvatarEvaluationText(const v1::AvatarEvaluation& evaluation);

// What `weft avatar show` prints.
std::string AvatarText(const std::string& path, const v1::Avatar& avatar);

// A verdict (services/formats/verdict/verdict.h) of "bad" where a goal is missed, for the exit status.
absl::Status GoalsStatus(const v1::AvatarEvaluation& evaluation);

}  // namespace weft
