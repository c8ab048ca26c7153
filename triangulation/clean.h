// Cleaning of a cloud: points that contradict their neighbours on the board move to `rejected`.
#pragma once

#include "absl/status/status.h"
#include "triangulation/cloud.h"

namespace weft {

// Lengths are in edges: the median distance of points whose nodes are next to each other on the board.
// Centres and corners are cleaned apart from each other. A point is compared with the nodes that are
// there: where few cells were seen, few speak for it, which is no reason to drop it.
struct CleaningOptions {
  // Density: of the nodes at most 3 rows and columns away, at least min_neighbors and at least
  // min_near_share of those that have a point must lie within 4.3 edges. Points that were given a wrong
  // place on the board lie far from the neighbours that they have there.
  int min_neighbors = 3;
  double min_near_share = 0.5;
  // Stretch: no node may have more than one edge longer than max_edge_ratio.
  double max_edge_ratio = 3;
  // Pieces: nodes at most 3 rows and columns apart belong together when they lie no further from
  // each other than max_edge_ratio times what the cells between them measure. Pieces of fewer than
  // min_component nodes are dropped unless such a bond of at most 10 cells leads to a larger one. The
  // largest always stays.
  int min_component = 30;
  // Points of two views need at least min_witnesses nodes of three or more views at most 3 cells away.
  // None of these may be further from the point than the cells between them allow, plus max_strain and
  // three sigmas.
  int min_witnesses = 3;
  double max_strain = 0.1;

  absl::Status Validate() const;
};

// The cloud without points that fail a test. Their nodes join `rejected` with kIsolated, kStretchedEdges,
// kSmallComponent or kUnconfirmed. The tests run in this order, each on the remaining points. Rows and
// columns must lie in 0 to 4096, a node occurs once, positions are finite.
Cloud CleanCloud(Cloud cloud, const CleaningOptions& options);

}  // namespace weft
