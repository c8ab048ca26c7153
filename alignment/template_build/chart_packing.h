// Panels packed into a square, as charts of a texture.
#pragma once

#include <vector>

#include "alignment/garment_parts.h"
#include "alignment/template_build/panel_sheet.h"

namespace weft {

// Packs the panels into the smallest square that the search finds. Panels are rotated by multiples of 90
// degrees only, so distances stay those of the print and cells lie on whole texels. Charts keep
// `gap_cells` between each other and half of that to the square's edge. Skyline heuristic with the charts'
// own lower outlines, widest first: each chart is placed where it lies deepest, over all rotations and
// columns. Sets the texture positions of `parts->panels` (one for each of the sheet's), texture_side_mm
// and texture_mm of the sheet's vertices. Deterministic.
void PackCharts(const PanelSheet& sheet, double cell_mm, int gap_cells, GarmentParts* parts);

}  // namespace weft
