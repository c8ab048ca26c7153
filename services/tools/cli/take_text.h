// Recorded takes in words.
#pragma once

#include <string>

#include "weft/v1/take.pb.h"

namespace weft {

std::string TakeInfoText(const v1::TakeInfo& info);
// How the cameras of a take that is made of videos came to be in step; empty for other takes.
std::string VideoSyncText(const v1::Take& take);
std::string TakeCheckText(const v1::TakeCheckReport& report);
std::string TakeRecoveryText(const v1::TakeRecoveryReport& report);

}  // namespace weft
