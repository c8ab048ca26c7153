// Agreement of cameras as a message.
#pragma once

#include "capture/rig/rig.h"
#include "triangulation/camera_agreement.h"
#include "weft/v1/report.pb.h"

namespace weft {

// Nothing for a camera that was not compared. `rig` is that of the agreement.
void DescribeAgreement(const CameraAgreement& agreement, const Rig& rig, v1::ViewReport& report);

}  // namespace weft
