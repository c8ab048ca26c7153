// Whether a rig's positions are in the unit of the garment.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh_graph.h"
#include "alignment/template.h"
#include "capture/rig/rig.h"
#include "triangulation/triangulate.h"

namespace weft {

// By what the rig's positions are to be multiplied so that the garment is where all cameras see it, to a
// tenth or so: how large its cells appear tells each camera's distance to it in mm. 1000 for a rig in metres.
// Empty where fewer than two views see enough, or all look from one side.
std::optional<double> RigScale(const Rig& rig, const std::vector<ViewObservations>& views,
                               const Template& garment, const MeshGraph& graph);

// FailedPrecondition, with the names of both files and the likely unit, for a scale that is not about 1.
absl::Status CheckRigScale(double scale, const std::string& rig_path, const std::string& garment_path);

}  // namespace weft
