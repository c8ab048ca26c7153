// The parts of a garment as template.json lists them.
#pragma once

#include "alignment/garment_parts.h"
#include "weft/v1/template.pb.h"

namespace weft {

void AddParts(const GarmentParts& parts, v1::Template& proto);

}  // namespace weft
