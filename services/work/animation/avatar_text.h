// Avatars and their evaluations as text.
#pragma once

#include <string>
#include <vector>

#include "weft/v1/avatar.pb.h"

namespace weft {

// How the baseline of the preset paper bears cameras that it was not trained for, beside ours.
std::vector<std::string> BaselineRemarks(const v1::AvatarEvaluation& evaluation);

// Scores, chaos floor and remarks as tables.
std::string AvatarEvaluationText(const v1::AvatarEvaluation& evaluation);

// What `weft avatar show` prints.
std::string AvatarText(const std::string& path, const v1::Avatar& avatar);

}  // namespace weft
