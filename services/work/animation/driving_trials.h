// A take of known cloth driven in other ways than the studio would: what cameras elsewhere, a dark camera and
// forgetting cost.
#pragma once

#include <tbb/task_arena.h>

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "alignment/template.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/paper/pixel_avatar.h"
#include "animation/rays/evidence.h"
#include "capture/take/frame_range.h"
#include "services/work/animation/cloth_take.h"
#include "services/work/animation/observed_take.h"
#include "services/work/animation/score_table.h"

namespace weft {

// One way to drive a take. Frames count from the first that is driven. `dark` says whether the first camera
// is, `tally_of` what to add a frame to, or null.
struct DrivingTrial {
  std::function<bool(int)> dark = [](int) { return false; };
  std::function<ScoreTally*(int)> tally_of;
  bool forgets = false;  // each frame by itself
  // What else is made of each frame; may be empty.
  std::function<absl::Status(int frame, const ClothFrame& truth, const std::vector<ViewObservations>& views)>
      beside;
};

// All that it is given must outlive it.
class DrivingTrials {
 public:
  // `baseline` may be null.
  DrivingTrials(const Template& garment, const SparseViewAvatar& avatar, const PixelAvatar* baseline,
                const Observing& observing, tbb::task_arena& driving, const std::stop_token& stop)
      : garment_(garment),
        avatar_(avatar),
        baseline_(baseline),
        observing_(observing),
        driving_(driving),
        stop_(stop),
        nodes_(garment) {}

  // Drives `frames`, by position. Errors of the take and the driver; Cancelled.
  absl::Status Drive(ClothTake& take, ObservedTake& seen, const FrameRange& frames,
                     const DrivingTrial& trial);

  // Methods "elsewhere" (before two cameras in each of two other places; of a baseline "paper elsewhere"),
  // "frame by frame", and while the first of two cameras is dark for 15 frames: "one dark", "after dark"
  // (frames 10 to 19 after it) and "never dark" (those, undisturbed). Takes that are too short are not
  // darkened.
  absl::Status TryAll(ClothTake& take, const std::string& split, const FrameRange& frames, ScoreTable& table);

 private:
  absl::Status TryElsewhere(ClothTake& take, const std::string& split, const FrameRange& frames,
                            ScoreTable& table);

  const Template& garment_;
  const SparseViewAvatar& avatar_;
  const PixelAvatar* baseline_;
  const Observing& observing_;
  tbb::task_arena& driving_;
  const std::stop_token& stop_;
  NodeVertices nodes_;
};

}  // namespace weft
