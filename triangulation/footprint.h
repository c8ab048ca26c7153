// What a decoded centre averages over, taken out again.
#pragma once

#include "absl/status/status.h"
#include "triangulation/cloud.h"

namespace weft {

// A decoder fits the centre of a cell to the whole of its coloured square, in every camera alike. On
// curved cloth the point is therefore biased into the fold, whatever the number of views. It is (1 -
// neighbor_share) times the material point at the centre plus neighbor_share times the mean of the four
// neighbouring centres. Lengths are in edges: the median distance of points whose centres are adjacent on
// the board.
struct FootprintOptions {
  // What the decoder of `pattern` leaves, measured on rendered cloth (footprint_decoder_test); 0 leaves the
  // points as they are.
  double neighbor_share = 0.06;
  // Folds hardly wider than a cell are no parabolas, and their bias shows in no view's residuals.
  // Curvature then differs from cell to cell. This is the standard deviation along each direction, as a
  // share of the root mean square difference of neighbouring curvatures within one cell of the centre.
  // Fitted to clouds of two renderers at once.
  double fold_error = 0.38;
  // What all views of a node share besides: light, ink, print.
  double shared_edges = 0.003;

  absl::Status Validate() const;
};

// Moves each centre to its material point. A corner is the mean of the four centres around it. On a
// parabola the mean of a cell's four corners lies (1 - share) of the sagitta away from the measured
// centre. The material point lies share of it on the other side. Where corners are missing the
// neighbouring centres estimate the curvature, less precisely. Covariances are propagated from the inputs
// of the shift, plus the remaining bias. Corners are not moved; points and rejected nodes keep their
// order. A node occurs once, rows and columns lie in 0 to 4096, positions are finite.
Cloud SharpenCenters(Cloud cloud, const FootprintOptions& options);

}  // namespace weft
