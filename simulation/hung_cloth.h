// A sheet that hangs from hooks, or a tube between two rings, in motion.
#pragma once

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "simulation/cloth.h"
#include "simulation/performance_source.h"

namespace weft {

// The options' cloth, without its motion.
ClothOptions ClothOptionsOf(const PerformanceOptions& options);

// Holds the cloth by its borders, lets folds grow and moves the handles (HandleMotion); a tube has a body
// inside. Errors of BuildCloth; Internal when the cloth diverges.
absl::StatusOr<std::unique_ptr<PerformanceSource>> HangCloth(const PerformanceOptions& options,
                                                             const std::function<void(double)>& on_progress);

}  // namespace weft
