// A take as a video to look at.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "services/studio/recording/take_copy.h"

namespace weft {

struct ProxyOptions {
  int camera_width_px = 0;  // of a camera's picture; 0: so that all of them are within 1920 px
};

// All cameras in one picture with their names, a frame per frame set at the rate of the take; where a camera
// has no frame, it says why. `out`: a file; its ending says what it is (mp4, mkv). Returns the number of
// sets. InvalidArgument: a take without frames, the width. NotFound: no ffmpeg. Internal: what ffmpeg says,
// for instance that it does not know the ending.
absl::StatusOr<uint64_t> ExportProxy(const std::string& take, const std::string& out,
                                     const ProxyOptions& options, const CopyProgress& progress = nullptr);

}  // namespace weft
