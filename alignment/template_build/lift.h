// Flat panels bent to where a cloud shows them.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/elastic_solver.h"
#include "alignment/mesh_graph.h"
#include "alignment/template_build/cell_grid.h"
#include "alignment/template_build/panel_sheet.h"

namespace weft {

// The panels of one cloud in space.
struct LiftedPanels {
  std::vector<Eigen::Vector3d> position_mm;  // [vertices]
  std::vector<bool> seen;                    // [vertices], measured and believed
  std::vector<bool> panel_placed;            // [panels]
};

// Prepared once for all clouds of a sheet; the sheet must outlive it.
class PanelLifter {
 public:
  explicit PanelLifter(const PanelSheet& sheet);

  // Measured vertices stay near their points, the others where the cloth's shape puts them (E_Det + E_Dist of
  // the paper, Eq. 1 and 2, with the flat panels at rest). FailedPrecondition when the cloud shows none of
  // the panels. Parallel loops run in the caller's TBB arena; the same result at any thread count.
  absl::StatusOr<LiftedPanels> Lift(const CellGrid& grid, double cell_mm) const;

 private:
  absl::Status Solve(const LiftedPanels& lifted, const std::vector<Eigen::Vector3d>& points,
                     Deformation* state) const;

  const PanelSheet& sheet_;
  MeshGraph graph_;
  SlicedMesh slices_;
};

}  // namespace weft
