// Decoded views as those that drive an avatar.
#pragma once

#include <vector>

#include "animation/sparse_view/sparse_view_driver.h"
#include "capture/rig/rig.h"
#include "pattern/observation.h"

namespace weft {

// Each with its camera of the rig, which must outlive them.
std::vector<DrivingView> DrivingViewsOf(const std::vector<ViewObservations>& seen, const Rig& rig);

}  // namespace weft
