// Several frames in one process: what `weft register` runs itself, and what every weft-worker runs.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "services/formats/options/presets.h"
#include "services/work/pipeline/registration_inputs.h"
#include "weft/v1/job.pb.h"

namespace weft {

// What a registration may take of the machine.
struct RegistrationLimits {
  int threads = 0;                                // 0: all cores
  int64_t kept_image_mib = kDefaultKeptImageMib;  // JobOptions::kept_image_bytes
};

// What happens while frames are registered. Calls never overlap.
struct RegistrationEvents {
  std::function<void(const std::string& frame)> started;
  std::function<void(const std::string& frame, double share)> advanced;  // 0 to 1
  std::function<void(const v1::FrameInfo& info)> finished;
  // Before images of the frame at this position of the dump are read; an error ends the registration.
  std::function<absl::Status(size_t index)> reads = [](size_t) { return absl::OkStatus(); };
};

// Registers the frames at these positions of the dump one after another, within `limits`.
// Then refines all frames whose neighbours are complete (refine_frame.h) and reports the frame as
// finished. `out` is an absolute path without links (output_folder.h), with one writer (result_lock.h).
// `job_frames`: positions of all frames of the job, in order, `frames` among them. Frames that are
// complete from an earlier run are kept and reported as reused. Cancelled when `stop` was requested:
// frames finished by then are complete. InvalidArgument: options. Any other error means that the results
// cannot be written; a frame that cannot be registered is no error.
absl::Status RegisterFrames(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames,
                            const std::vector<size_t>& frames, const v1::RegistrationOptions& asked,
                            const std::string& out, const RegistrationLimits& limits,
                            const RegistrationEvents& events, std::stop_token stop);

}  // namespace weft
