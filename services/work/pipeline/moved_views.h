// Observations of cameras that looked a little before or after a frame's moment, brought to it.
#pragma once

#include <stop_token>
#include <vector>

#include "capture/take/view_moment.h"
#include "services/work/pipeline/frame_cloud.h"
#include "triangulation/rolled_observations.h"
#include "weft/v1/report.pb.h"

namespace weft {

// What the cameras concerned saw on the other side of the moment.
class MovedViews {
 public:
  // Decodes it, for every view of `decoded` that has observations and was taken at another moment.
  // Nothing is decoded for dumps whose times do not compare. Views whose other image cannot be
  // read stay as they are. Runs in the calling thread's TBB arena.
  static MovedViews Decode(const FrameImages& images, const DecodeOptions& options,
                           const std::stop_token& stop, const DecodedFrame& decoded);

  // Replaces observations as they were decoded by those at the frame's moment (RollToMoment), and back.
  void Move(std::vector<ViewObservations>& views);
  void Undo(std::vector<ViewObservations>& views) const;
  // Says of which moment each view was; `reports` has an entry per view.
  void Describe(std::vector<v1::ViewReport>& reports) const;

 private:
  struct Other {
    size_t view = 0;
    double own_s = 0;
    SeenAt seen;
    std::vector<Observation> as_decoded;  // of the view itself
  };
  std::vector<Other> others_;
};

}  // namespace weft
