// Whether the results of a job are there, before anybody says that it is done.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/job.pb.h"

namespace weft {

// How often frames of one job may have to be done again before it is given up.
inline constexpr int kMaxRepairs = 10;

struct IncompleteFrame {
  size_t position = 0;          // in the list of frames
  std::string why;              // e.g. "mesh.ply is missing"
  bool inputs_changed = false;  // its images, scan or start are others than those that were read
};

// Done, degraded or failed: something stands in the frame's folder.
inline bool HasResult(v1::FrameState state) {
  return state == v1::FRAME_STATE_DONE || state == v1::FRAME_STATE_DEGRADED ||
         state == v1::FRAME_STATE_FAILED;
}

// Checks the files of all frames that HasResult. They must be as listed in their
// report, computed from the job's inputs and options, from images as they are now, and refined by their
// neighbours. Other frames are to be registered again. Where only the bridge of a failed frame is missing,
// the frame named is a neighbour that produces it. `frames`: all frames of the job, in order. Folders of
// complete frames are on the disk when it returns. spec.out is an absolute path without links. Errors when
// the folder cannot be read or flushed, and of FingerprintsNow::Open.
absl::StatusOr<std::vector<IncompleteFrame>> FindIncompleteFrames(const v1::Job& job,
                                                                  const std::vector<v1::FrameInfo>& frames);

// The status of a job whose frames had to be done again too often.
absl::Status TooManyRepairs(const std::string& out, const std::string& frame, const std::string& why);

}  // namespace weft
