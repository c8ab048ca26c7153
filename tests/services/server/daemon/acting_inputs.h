// Inputs of a job for tests: the dump is a text file with a frame's name on each line, which tells
// acting_worker how to behave. Rig, board and template are any files.
#pragma once

#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "services/formats/files/atomic_file.h"
#include "services/server/daemon/work/prepare_job.h"

namespace weft {

inline absl::StatusOr<LoadedInputs> LoadActingInputs(const v1::RegistrationSpec& spec) {
  const absl::StatusOr<std::string> text = ReadWholeFile(spec.dump());
  if (!text.ok()) return text.status();
  LoadedInputs inputs;
  inputs.frames = absl::StrSplit(*text, '\n', absl::SkipEmpty());
  inputs.hashes.set_rig("0123456789abcdef");
  inputs.warnings = {"camera 7 has no images"};
  return inputs;
}

}  // namespace weft
