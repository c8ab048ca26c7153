// Frames of the cameras of a session, as they film, while they are recorded.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "services/studio/recording/live_recording.h"
#include "services/work/animation/live_feed.h"

namespace weft {

// A feed whose frames come from memory: a frame set arrives when its last picture has, and waits for no disk.
class CameraFeed : public LiveFeed {
 public:
  // Opens the cameras of `session_file`, and records them into the new folder `take` until Finish, or until
  // the cameras end. `fps` is that of cameras whose clocks tell nothing. Errors of ReadSession, OpenCameras
  // and RecordLive, as far as they show before the first frame.
  static absl::StatusOr<std::unique_ptr<CameraFeed>> Start(const std::string& session_file,
                                                           const std::string& take, const Rig& rig,
                                                           double fps);

  // Ends the recording and waits for it: how the take ended, as RecordLive says. No frame comes afterwards.
  virtual absl::StatusOr<v1::Take> Finish() = 0;
};

}  // namespace weft
