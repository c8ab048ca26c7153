// What became of views of boards that several cameras saw at the same moment.
#pragma once

#include <array>
#include <map>
#include <vector>

#include "capture/calibration/board_view.h"
#include "capture/calibration/calibration_bundle.h"

namespace weft {

// The median residual of a view's corners, in px; infinite for boards behind the camera.
double Misfit_px(const CalibrationBundle& bundle, const BundleView& view);

// Frame, board and camera of views that were left out as a whole, with their misfit then.
using RejectedViews = std::map<std::array<int, 3>, double>;

struct SharedViewFate {
  int camera = 0;
  int frame = 0;
  bool is_rejected = false;  // most of its corners do not fit
  // By more than a right camera is ever off. Tags that are small, tilted or blurred fit worse than their
  // sigma, without anything being wrong with the camera.
  bool is_far = false;
};

// Of views with `min_corners`, by frame. A board that one camera alone saw fits it wherever the camera is.
// Of two cameras that disagree either may be the wrong one, and any where half of them are far off: all
// count. `bundle`: after the adjustment, with the corners that were kept.
std::vector<SharedViewFate> FollowSharedViews(const CalibrationViews& views, int min_corners,
                                              const CalibrationBundle& bundle, const RejectedViews& left_out);

}  // namespace weft
