// Which outlines of the panels are sewn together.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "alignment/garment_parts.h"
#include "alignment/template_build/panel_borders.h"

namespace weft {

struct SeamOptions {
  double max_gap_mm = 0;     // between the outermost cells of both sides; 0: four pitches
  int min_points = 8;        // a run of fewer border points is no seam, unless two others end where it begins
  double max_easing = 0.35;  // one side may be longer by this share

  absl::Status Validate() const;
};

// Seams are consistent runs of border points that are close in space and opposite in direction. A point's
// partner is the nearest such point of another outline, or of a distant part of the same one. Both must
// choose each other, and partners must advance steadily. The longest runs are fixed first, then all are
// extended to their corners. Where two of them end, one of fewer points may close a band to a ring. A
// point belongs to two seams at most, an edge to one. Ordered by first vertex.
std::vector<Seam> FindSeams(const PanelBorders& borders, double cell_mm, const SeamOptions& options);

// Runs that look like seams with up to `factor` times the greatest gap and whose sides face each other
// squarely, among the border edges that `seams` leave open. Where both ends of a run border on seams the
// cloth between must be sewn as well, it was merely not seen: these have `wide` set. The others may be a seam
// that is too far apart, or no seam.
std::vector<Seam> FindNearSeams(const PanelBorders& borders, const std::vector<Seam>& seams, double cell_mm,
                                double factor, const SeamOptions& options);

}  // namespace weft
