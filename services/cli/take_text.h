// Recorded takes in words.
#pragma once

#include <string>

#include "weft/v1/take.pb.h"

namespace weft {

std::string TakeInfoText(const v1::TakeInfo& info);
std::string TakeCheckText(const v1::TakeCheckReport& report);
std::string TakeRecoveryText(const v1::TakeRecoveryReport& report);

}  // namespace weft
