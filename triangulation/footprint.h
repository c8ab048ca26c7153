// What a decoded centre averages over, taken out again.
#pragma once

#include "absl/status/status.h"
#include "triangulation/cloud.h"

namespace weft {

// A decoder finds the centre of a cell by the whole of its coloured square, every camera in the same way. On
// bent cloth the point is therefore (1 - neighbor_share) times the thread at the centre plus neighbor_share
// times the mean of the four neighbouring centres, whatever the number of views, and lies inside the fold.
// Lengths are in edges: the median distance of points whose centres are next to each other on the board.
struct FootprintOptions {
  // What the decoder of `pattern` leaves, measured on rendered cloth (footprint_decoder_test); 0 leaves the
  // points as they are.
  double neighbor_share = 0.06;
  // Folds hardly wider than a cell are no parabolas, and what a decoder loses of them shows in no view's
  // residuals, but bends then differ from cell to cell: standard deviation along each direction, as a share
  // of the root mean square difference of neighbouring bends within one cell of the centre. Fitted to clouds
  // of two renderers at once.
  double fold_error = 0.38;
  // What all views of a node share besides: light, ink, print.
  double shared_edges = 0.003;

  absl::Status Validate() const;
};

// Moves each centre to where its thread is. A corner is the mean of the four centres around it, so on cloth
// bent like a parabola the mean of a cell's four corners lies (1 - share) of the bend away from the measured
// centre, and the thread share of the bend on the other side. Where corners are missing the neighbouring
// centres tell the bend, less well. Covariances follow: propagated from what the shift was computed of, plus
// what it leaves. Corners stay; points and rejected nodes keep their order. A node occurs once, rows and
// columns lie in 0 to 4096, positions are finite.
Cloud SharpenCenters(Cloud cloud, const FootprintOptions& options);

}  // namespace weft
