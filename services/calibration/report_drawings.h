// Drawings of a calibration's report as inline SVG.
#pragma once

#include <string>

#include "services/calibration/calibrate_dump.h"

namespace weft {

// A panel per camera: its image in 3 x 3 parts, those without corners shaded, residuals of some corners as
// lines `magnified` times their length.
std::string ImagePanels(const CalibrationResult& result, double magnified);

// The rig seen along a world axis, with where the boards were, and lines between cameras that share boards,
// the more the darker. `right` and `down` are the world axes of the paper. Empty without a solution.
std::string LinkDrawing(const CalibrationResult& result, const std::string& title, int right, int down);

// Who shares boards with whom, a square per pair of cameras, for up to 64 cameras; empty for more.
std::string LinkMatrix(const CalibrationResult& result);

}  // namespace weft
