// What curved sides of tags do to corners that are found as straight lines.
#pragma once

#include "capture/calibration/calibration_bundle.h"

namespace weft {

// A lens and a bent board curve the sides of a tag by a few hundredths of a pixel, all sides of a view to the
// same side. SharpenSquare lays straight lines through short ones, so that the corners of a view are off
// together: the bundle would take that for a pose. Moves the corners of views with `straight_sides` by what
// the bundle, as it stands, says of every side; corners that were moved before are first put back. Parallel
// in the calling thread's TBB arena, the same bytes at any thread count.
void CorrectSideBows(CalibrationBundle* bundle);

}  // namespace weft
