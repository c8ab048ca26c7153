// Coverage as pictures.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "services/results/report/job_report.h"
#include "services/studio/preview/coverage.h"

namespace weft {

// "#rrggbb" of a class: grey without a camera, oranges below the three that make a point, blues from there.
std::string CoverageColor(size_t coverage_class);

// Both sides of the garment; its seams, which have no cell, are dark. Errors of RenderMesh.
absl::StatusOr<std::vector<MeshPicture>> PaintGarment(const Template& garment, const Coverage& coverage);

// The board, enlarged to about 640 px; transparent where a cell does not count.
MeshPicture PaintBoard(const Coverage& coverage);

}  // namespace weft
