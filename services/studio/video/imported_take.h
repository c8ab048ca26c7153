// The files of a take that is made of videos: a stream per camera, each whole before the next step, and the
// ledger.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "capture/image/frame.h"
#include "capture/take/stream_writer.h"
#include "services/studio/video/frame_plan.h"
#include "weft/v1/take.pb.h"
#include "weft/v1/video.pb.h"

namespace weft {

struct ImportedTake {
  std::string folder;
  const v1::Take& take;                       // its totals are those of the plan
  const std::vector<v1::VideoFacts>& videos;  // in the order of the take's cameras
  const FramePlan& plan;
  std::vector<std::vector<double>> times_s;  // of each camera's frames
  StreamWriterOptions stream;
  std::optional<PixelFormat> mosaic;
};

// Numbers of the plan: frames that are missing in all sets.
uint64_t FramesMissing(const FramePlan& plan);

// ResourceExhausted: the disk has no room for what is to be written there, beside what an earlier try wrote.
absl::Status CheckRoom(const ImportedTake& imported, const std::string& out);

// Writes the stream of one camera, unless it stands there already, closed and of this take. `done` is called
// for each frame set; false stops. Errors of VideoFrames and StreamWriter; Cancelled.
absl::Status WriteCameraStream(const ImportedTake& imported, size_t camera,
                               const std::function<bool()>& done);

// A line of a camera, or of all (empty).
struct LedgerNote {
  std::string camera, text;
  bool is_warning = false;
};
absl::Status WriteLedger(const ImportedTake& imported, const std::vector<LedgerNote>& notes);

}  // namespace weft
