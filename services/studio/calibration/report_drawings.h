// Drawings of a calibration's report as inline SVG.
#pragma once

#include <string>
#include <vector>

#include "services/results/report/rig_drawing.h"
#include "services/studio/calibration/calibrate_dump.h"

namespace weft {

// A panel per camera: its image in 3 x 3 parts, those without corners shaded, residuals of some corners as
// lines `magnified` times their length.
std::string ImagePanels(const CalibrationResult& result, double magnified);

// The rig with where the boards were, and lines between cameras that share boards, the more the darker.
// Empty without a solution.
std::string LinkDrawing(const CalibrationResult& result, const PaperAxes& axes);

// Boards that each camera saw, [cameras]: what the page calls views.
std::vector<int> ViewsOfBoards(const CalibrationViews& views);

// Who shares boards with whom, a square per pair of cameras, for up to 64 cameras; empty for more.
std::string LinkMatrix(const CalibrationResult& result);

}  // namespace weft
