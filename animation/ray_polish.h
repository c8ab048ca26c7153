// The mesh that passes through rays, is as long and wide as the cloth, and else bends like its carrier.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "animation/evidence.h"

namespace weft {

struct PolishOptions {
  // Standard deviations per edge, against the rays' sigmas: of its direction and length from those of the
  // carrier turned with the cloth around it, and of the turn from one vertex to the next, times the edge.
  double stretch_sigma_mm = 2;
  double bending = 1;            // weight of turns against stretch, as in E_Dist
  double carrier_sigma_mm = 50;  // of a vertex alone; many together hold what no ray does
  int iterations = 40;
  // Rays further from the cloth around them than this many spreads, and than a good part of an edge, are set
  // aside, after each round.
  int rounds = 2;
  double outlier_spreads = 5;

  absl::Status Validate() const;
};

struct PolishedMesh {
  std::vector<Eigen::Vector3d> position_mm;  // [vertices]
  std::vector<bool> rejected;                // [rays]
  int iterations = 0;
};

// How long edges of the garment are, [edges]: mean and standard deviation.
struct EdgeLengths {
  std::span<const float> mean_mm, spread_mm;
};

// Minimises the rays' normal equations plus E_Dist, whose edges at rest are those of the carrier, no further
// from their mean length than their spread, plus a weak pull to the carrier. Rays are ordered by vertex.
// Errors of SolveElastic. The same bytes at any thread count.
absl::StatusOr<PolishedMesh> PolishToRays(const AlignmentModel& model, const EdgeLengths& lengths,
                                          const std::vector<Eigen::Vector3d>& carrier_mm,
                                          const std::vector<VertexRay>& rays, const PolishOptions& options);

}  // namespace weft
