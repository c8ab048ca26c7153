// A simulated recording of boards, to try calibration and to plan it.
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "capture/calibration/target.h"
#include "simulation/board_motion.h"
#include "simulation/board_renderer.h"
#include "simulation/studio_rig.h"

namespace weft {

struct RehearsalOptions {
  StudioRigOptions rig;
  BoardMotionOptions motion;
  BoardLookOptions look;
};

// Renders <out>/<frame>/<camera>.png of the target moved through the rig's volume, and writes
// <out>/truth/rig.json, the rig that took them. `on_image` (may be empty): images done and all, from any
// thread. Errors of MakeStudioRig and MoveTarget, and of writing. Parallel in the calling thread's TBB arena.
absl::Status WriteRehearsal(const std::string& out, const CalibrationTarget& target,
                            const RehearsalOptions& options,
                            const std::function<void(size_t, size_t)>& on_image = {});

}  // namespace weft
