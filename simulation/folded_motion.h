// Pleats, gathers and curls in motion.
#pragma once

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "simulation/performance_source.h"

namespace weft {

// Whether cloth of this kind is made to fold (folded_cloth.h).
bool IsFolded(GarmentKind kind);

// Makes the cloth, lets it settle, and moves its handles (HandleMotion). They turn around the vertical by
// `twist_deg` each way and sway; legs in a skirt walk at the same frequency. Errors of BuildCloth;
// Internal when the cloth diverges.
absl::StatusOr<std::unique_ptr<PerformanceSource>> MoveFoldedCloth(
    const PerformanceOptions& options, const std::function<void(double)>& on_progress);

}  // namespace weft
