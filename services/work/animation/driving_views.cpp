#include "services/work/animation/driving_views.h"

namespace weft {

std::vector<DrivingView> DrivingViewsOf(const std::vector<ViewObservations>& seen, const Rig& rig) {
  std::vector<DrivingView> out;
  for (const ViewObservations& view : seen)
    out.push_back({&rig.cameras[static_cast<size_t>(view.camera)], view.observations});
  return out;
}

}  // namespace weft
