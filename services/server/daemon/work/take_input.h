// Takes of the daemon as inputs of jobs.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace weft {

// "take:<id>" as the folder of that take; anything else as it is. InvalidArgument: no id of a take.
absl::StatusOr<std::string> TakeOfName(const std::string& takes_folder, const std::string& name);

}  // namespace weft
