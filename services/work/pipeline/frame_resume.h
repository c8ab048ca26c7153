// What an earlier run left of a frame, and how to go on from there.
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "services/work/pipeline/algorithm_versions.h"
#include "services/work/pipeline/register_frame.h"

namespace weft {

struct CachedStages {
  // The first stage to compute: decoding, alignment or refinement, since these begin with what files hold.
  // None: everything stands.
  std::optional<Stage> redo = Stage::kDecode;
  std::string why;         // why earlier results do not stand; empty where there are none
  v1::FrameReport report;  // of the earlier run; empty where all is to be computed
};

// A result is kept when its file is intact, the frame's images, scan and start are the same, and the keys
// of its stage and of those before agree (stage_keys.h). Failed frames are not kept. A complete frame is
// flushed to the disk.
CachedStages InspectFrame(const RegistrationInputs& inputs, size_t index, const JobOptions& options,
                          const std::string& out);

// Computes what does not stand, and keeps the files of the stages before. The results are those of a frame
// that is computed from its images, to the last bit. Errors, arena and threads as RegisterFrame; refinement
// itself is up to RefineAround.
absl::StatusOr<v1::FrameReport> ResumeFrom(const CachedStages& standing, const RegistrationInputs& inputs,
                                           size_t index, const JobOptions& options, const std::string& out,
                                           const FrameProgress& progress, std::stop_token stop);

}  // namespace weft
