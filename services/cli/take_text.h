// Recorded takes in words, and messages as JSON.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "weft/v1/take.pb.h"

namespace weft {

std::string TakeInfoText(const v1::TakeInfo& info);
std::string TakeCheckText(const v1::TakeCheckReport& report);
std::string TakeRecoveryText(const v1::TakeRecoveryReport& report);

// On standard output.
absl::Status PrintJsonMessage(const google::protobuf::Message& message);

}  // namespace weft
