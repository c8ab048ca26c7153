// Values painted on a garment, as pages hold them.
#pragma once

#include "alignment/mesh.h"
#include "services/results/report/garment_map.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {

// Nothing without values; a map that cannot be drawn is a problem.
void AddGarmentMap(const TriangleMesh& shape, const GarmentMap& map, v1::PageMaps& maps);

}  // namespace weft
