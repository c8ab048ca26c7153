// Panels packed into a square, as charts of a texture.
#pragma once

#include <vector>

#include "alignment/garment_parts.h"
#include "alignment/template_build/panel_sheet.h"

namespace weft {

// Lays the panels into the smallest square that the search finds, each as it is on the board and turned by
// quarters only, so that distances stay those of the print and cells lie on whole texels. Charts keep
// `gap_cells` between each other and half of that to the square's edge. Widest first; a chart drops, turned
// each way and at each column, onto the outline of those that lie already (the skyline heuristic, with the
// charts' own lower outlines), and stays where it comes to lie deepest. The square is the smallest of those
// that hold all of them so. Sets the texture places of `parts->panels` (one for each of the sheet's),
// texture_side_mm and texture_mm of the sheet's vertices. Deterministic.
void PackCharts(const PanelSheet& sheet, double cell_mm, int gap_cells, GarmentParts* parts);

}  // namespace weft
