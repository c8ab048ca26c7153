// Frames as they arrive: the newest one, whenever it is asked for.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"
#include "services/work/animation/drive_inputs.h"

namespace weft {

struct LiveFrame {
  std::string name;
  std::shared_ptr<const FrameSource> source;  // of the rig's cameras; has the frame at `index`
  size_t index = 0;
  int64_t time_ns = 0;     // when it was taken; later than that of the frame given before
  int64_t arrived_ns = 0;  // HostTime_ns, when its last picture was there
  int passed_over = 0;     // frames that arrived since the one given before and are not given
};

// Thread safety: one thread asks.
class LiveFeed {
 public:
  virtual ~LiveFeed() = default;

  // The newest frame that was not given yet; waits for one. Empty at the end, and once `stop` is requested.
  virtual absl::StatusOr<std::optional<LiveFrame>> Newest(const std::stop_token& stop) = 0;
};

// A take that another process records, from the first frame set after the one named `after` (empty: from the
// first). A frame set arrives when the recorder has it; it can be read once the recorder has flushed it. Ends
// when the take is closed, or nobody records it any more. `fps` is that of takes whose clocks tell nothing.
std::unique_ptr<LiveFeed> FollowTake(std::string folder, Rig rig, std::string after, double fps);

// Frames of a recording that is over, each arriving when its time comes, `speed` times as fast as they were
// taken; the first one arrives when it is asked for.
std::unique_ptr<LiveFeed> PlayFrames(DriveFrameList list, double speed);

}  // namespace weft
