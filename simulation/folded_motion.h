// Pleats, gathers and curls in motion.
#pragma once

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "simulation/performance_source.h"

namespace weft {

// Whether cloth of this kind is made to fold (folded_cloth.h).
bool IsFolded(GarmentKind kind);

// Makes the cloth, lets it settle, and moves what holds it (HandleMotion): it turns around the vertical by
// `twist_deg` each way and sways; legs in a skirt walk at the same pace. Errors of BuildCloth; Internal when
// the cloth diverges.
absl::StatusOr<std::unique_ptr<PerformanceSource>> MoveFoldedCloth(
    const PerformanceOptions& options, const std::function<void(double)>& on_progress);

}  // namespace weft
