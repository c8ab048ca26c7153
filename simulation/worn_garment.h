// A garment on a body that moves: dressing, settling, frames.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "simulation/performance_source.h"
#include "simulation/printed_mesh.h"

namespace weft {

// The integration's step that suits the cell of a worn garment.
double AutomaticStepS(const PerformanceOptions& options);

// T-shirt, skirt, or both. Lets the body grow into the sewn garment, lowers the arms and waits for the cloth
// to hang; that is the garment's rest. Cells of 3.1 mm and less are put on as a garment of twice the cell,
// which then is refined. Errors of MakeTShirt and MakeSkirt; Internal when the cloth diverges.
absl::StatusOr<std::unique_ptr<PerformanceSource>> WearGarment(
    const PerformanceOptions& options, const std::function<void(double)>& on_progress);
// One that goes on where SaveState was called. DataLoss when the state is of another build or garment.
absl::StatusOr<std::unique_ptr<PerformanceSource>> ResumeGarment(const PerformanceOptions& options,
                                                                 std::string_view state);

// How such a garment of these faces and cells is printed, up to its seams; empty where they are of none.
std::optional<ClothPrint> PrintOfWorn(const std::vector<Face>& faces, double cell_mm);

}  // namespace weft
