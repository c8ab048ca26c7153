// What the inputs of a job hold.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/job.pb.h"

namespace weft {

struct LoadedInputs {
  std::vector<std::string> frames;  // the names of those that are asked for
  v1::InputHashes hashes;
  std::vector<std::string> warnings;
  std::optional<v1::DrivenJob> driven;  // of jobs with spec.driving
};

// Reads the inputs of a job and checks them against each other.
using InputsLoader = std::function<absl::StatusOr<LoadedInputs>(const v1::RegistrationSpec& spec)>;

// An InputsLoader. Errors of LoadInputs and FramesInRange, or of LoadDriveInputs and ListDriveFrames.
absl::StatusOr<LoadedInputs> LoadJobInputs(const v1::RegistrationSpec& spec);

}  // namespace weft
