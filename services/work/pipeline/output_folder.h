// Where the results of a registration may go.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/job.pb.h"

namespace weft {

// InvalidArgument: spec.out is, lies in, or contains what the registration reads: dump, rig, board, template,
// scans, starts, avatar. Names both.
absl::Status CheckOutOfInputs(const v1::RegistrationSpec& spec);

// Makes the folder where it is missing, and returns its path without links, which is what RegisterFrames
// wants. Errors of CreateFolders.
absl::StatusOr<std::string> MakeOutputFolder(const std::string& out);

}  // namespace weft
