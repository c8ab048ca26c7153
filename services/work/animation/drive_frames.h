// Frames of a take driven in one process: what `weft avatar drive` runs itself, and what a weft-worker runs.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "services/work/animation/drive_inputs.h"
#include "services/work/pipeline/registration.h"

namespace weft {

// Drives frames one after another and writes <out>/<frame>/mesh.ply, report.json and, where asked for,
// observations.csv; the next frame is decoded meanwhile. `list` has all frames of the job; events tell of
// those whose positions in it are in `asked`, in order. A frame that shows too little of the garment gets a
// report with state FAILED and the reason, and no mesh.
//
// Complete frames of the same inputs and options are kept and reported as reused where they follow the frame
// before them, whose report says what the driver knew then. So a frame is driven once, and the files are the
// same in one go and in several, and at any number of threads, times aside. Frames before an asked one that
// are not there are driven, too, but for those that were set aside.
//
// `threads`: 0 for all cores. `out` is an absolute path without links (output_folder.h), with one writer.
// Cancelled when `stop` was requested: frames finished by then are complete. Other errors: the folder of the
// results; FailedPrecondition, with both names: the rig's positions are in another unit than the template's.
absl::Status DriveFrames(const v1::RegistrationSpec& spec, const DriveInputs& inputs,
                         const DriveFrameList& list, const std::vector<size_t>& asked, const std::string& out,
                         int threads, const RegistrationEvents& events, const std::stop_token& stop);

}  // namespace weft
