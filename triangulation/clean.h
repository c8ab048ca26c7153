// Cleaning of a cloud: points that contradict their neighbours on the board move to `rejected`.
#pragma once

#include "absl/status/status.h"
#include "triangulation/cloud.h"

namespace weft {

// Lengths are in edges: the median distance of points whose nodes are next to each other on the board.
// Centres and corners are cleaned apart from each other.
struct CleaningOptions {
  // Density: of the nodes at most reach_cells rows and columns away, this many must lie within radius_edges.
  // Points that were given a wrong place on the board lie far from the neighbours they have there.
  int reach_cells = 3;
  double radius_edges = 3.7;
  int min_neighbors = 10;
  // Stretch: no node may have more than max_long_edges edges longer than max_edge_ratio.
  double max_edge_ratio = 3;
  int max_long_edges = 1;
  // Pieces: nodes joined by edges that are not long. Smaller ones are dropped unless one of their nodes has a
  // node of a larger piece at most max_gap_cells rows and columns away, no further in space than
  // max_edge_ratio times what the cells between them measure. The largest piece always stays.
  int min_component = 30;
  int max_gap_cells = 10;

  absl::Status Validate() const;
};

// The cloud without points that fail a test; their nodes join `rejected` with kIsolated, kStretchedEdges or
// kSmallComponent (the tests run in this order, each on what the one before left). Rows and columns must lie
// in 0 to 4096, a node occurs once, positions are finite.
Cloud CleanCloud(Cloud cloud, const CleaningOptions& options);

}  // namespace weft
