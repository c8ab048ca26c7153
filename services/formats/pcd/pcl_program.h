// The program weft-pcl at work: PCL in a process of its own. PCL's files bring VTK, which would slow down
// every start, and its readers were not made for damaged files: what crashes is this process alone.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// FailedPrecondition with the remedy where weft-pcl is not installed beside the program that runs.
absl::Status CheckPclProgram();

// What `weft-pcl task` makes of `input`. `source_name` stands in errors. FailedPrecondition as
// CheckPclProgram; InvalidArgument: PCL cannot take the input; Internal: it crashed or was killed;
// ResourceExhausted: it cannot be started. Runs until the process ends; processor time and memory of weft-pcl
// are limited.
absl::StatusOr<std::string> RunPclProgram(const std::string& task, std::string_view input,
                                          const std::string& source_name);

}  // namespace weft
