// Which cameras a session can name.
#pragma once

#include <string>

#include "weft/v1/camera.pb.h"

namespace weft {

// GigE Vision cameras that answer (takes about a second) and V4L2 cameras of this machine, with what they
// offer.
v1::CameraList ListCameras();

// `details`: formats and controls as well.
std::string CameraListText(const v1::CameraList& list, bool details);

}  // namespace weft
