// What is known of nodes that were seen and have no point.
#pragma once

#include <vector>

#include "capture/rig/rig.h"
#include "triangulation/cloud.h"
#include "triangulation/triangulate.h"

namespace weft {

// A ray for each observation of a node that `cloud` rejects, ordered by node, then view. `views` are those of
// the cloud. Left out are observations for which the lens model has no inverse.
std::vector<CloudRay> RaysOfRejected(const Rig& rig, const std::vector<ViewObservations>& views,
                                     const Cloud& cloud, const RefinementOptions& options);

}  // namespace weft
