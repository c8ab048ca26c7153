// The sewn garment's mesh at rest: near the cloud, as long everywhere as the print.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"

namespace weft {

struct RestShapeOptions {
  int iterations = 40;
  double length_weight = 10;      // of an edge's length
  double seam_weight = 0.3;       // of edges that are in no panel, as a share of length_weight
  double bending_weight = 0.03;   // of a vertex's distance from the mean of its neighbours
  double kept_bends = 0;          // share of that distance in the start which is no bending
  double seen_weight = 0.001;     // holds measured places
  double unseen_weight = 0.0001;  // holds the others
  int border_rings = 1;           // vertices closer to the border of their panel do not resist bending

  absl::Status Validate() const;
};

// Draws seams together between their ends.
inline constexpr RestShapeOptions kPulledSeams{
    .iterations = 30, .bending_weight = 0.3, .kept_bends = 1, .seen_weight = 1, .unseen_weight = 0.001};

// The rest state: first wrinkles are smoothed, which registration would otherwise expect in every frame, then
// the lengths of the print restored. Beside seams the cloth keeps its bends.
inline constexpr RestShapeOptions kSmoothedWrinkles{.bending_weight = 10, .border_rings = 8};
inline constexpr RestShapeOptions kPrintedLengths;

// Two vertices on either side of a seam, and how far apart they were measured.
struct MeasuredGap {
  int a = -1, b = -1;
  double length_mm = 0;
};

// What the rest state is held to.
struct RestShapeProblem {
  std::vector<Face> faces;
  int panel_faces = 0;  // the first faces are those of the panels: their edges have their length on the board
  std::vector<Eigen::Vector3d> flat_mm;   // [vertices] on the board
  std::vector<Eigen::Vector3d> start_mm;  // [vertices]
  std::vector<MeasuredGap> measured;
  // Edges that are in no panel have their length in start_mm, but at most this.
  double most_seam_mm = 0;
  std::vector<bool> seen;   // [vertices] held to start_mm
  std::vector<bool> fixed;  // [vertices] stay where they are; empty: none
};

// Minimises the sum over edges and measured gaps of (length - rest length)^2, with a prior on the start
// and smoothness within panels. Alternates between edge directions and a prefactored linear system (Liu et
// al. 2013, Fast simulation of mass-spring systems). Deterministic.
absl::StatusOr<std::vector<Eigen::Vector3d>> RefineRestShape(const RestShapeProblem& problem,
                                                             const RestShapeOptions& options);

// How far the edges within panels are from their length on the board.
struct RestStrain {
  double median = 0, p95 = 0, most = 0;  // |length / length on the board - 1|
  std::vector<double> of_vertex;         // [vertices], mean over its edges in the panel
};
RestStrain MeasureRestStrain(const RestShapeProblem& problem, const std::vector<Eigen::Vector3d>& rest_mm);

}  // namespace weft
