// What the reports of frames say of the rig's cameras together.
#pragma once

#include <vector>

#include "services/formats/verdict/camera_checks.h"
#include "weft/v1/report.pb.h"

namespace weft {

// Cameras in order of first appearance. Frames of versions that measured nothing of this add nothing.
CameraFacts FactsOf(const std::vector<v1::FrameReport>& frames);

}  // namespace weft
