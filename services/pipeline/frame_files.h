// The files of one frame: <out>/<frame>/.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "services/pipeline/frame_stages.h"

namespace weft {

// Replaces the files of the frame. An older report goes first and the new one comes last, so that a frame
// with a report is always complete; a mesh of an earlier run does not survive a frame that now has none.
absl::Status WriteFrame(const std::string& folder, const RegistrationInputs& inputs,
                        const FrameResult& frame);

// The report in `folder` when all files that it speaks of are there; NotFound otherwise.
absl::StatusOr<v1::FrameReport> ReadCompleteReport(const std::string& folder);

}  // namespace weft
