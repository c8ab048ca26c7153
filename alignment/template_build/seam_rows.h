// Vertices between the panels: a row along each seam, and one where seams meet. They have no cell.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/garment_parts.h"
#include "alignment/template_build/lift.h"
#include "alignment/template_build/panel_borders.h"
#include "alignment/template_build/rest_shape.h"

namespace weft {

// Undoes the closing of panels that finding their seams needs, from `clouds` (the reference first).
// Observed vertices return to their points. Seams take the width in a cloud that shows both sides.
void RestoreWidths(const std::vector<LiftedPanels>& clouds, LiftedPanels* reference,
                   std::vector<Seam>* seams);

// The strips that close the seams, each with a row of vertices along its middle (`Seam::middle`): cloth folds
// there, and edges twice as long as a cell would not. The vertices join `reference`, unseen.
std::vector<Face> ZipWithRows(const PanelBorders& borders, double cell_mm, std::vector<Seam>* seams,
                              LiftedPanels* reference);

// Gaps of seams of which a cloud shows both sides; the mean over the clouds that do.
std::vector<MeasuredGap> MeasureGaps(const std::vector<Seam>& seams,
                                     const std::vector<Eigen::Vector3d>& reference_mm,
                                     const std::vector<LiftedPanels>& clouds);

// Faces over a hole of `faces`. A compact hole of six vertices or more lies where seams meet and gets a
// vertex in its middle, which joins `reference`; a vertex beside it joins `beside`. Errors as FillHole.
absl::StatusOr<std::vector<Face>> FillWhereSeamsMeet(const std::vector<int>& loop,
                                                     const std::vector<Face>& faces, double cell_mm,
                                                     LiftedPanels* reference, std::vector<int>* beside);

// The texture's places of these vertices behind those of the panels': each that of a vertex beside it.
void AddSeamTexture(const std::vector<int>& beside, GarmentParts* parts);

}  // namespace weft
