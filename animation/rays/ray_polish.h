// The mesh that passes through rays, is as long and wide as the cloth, and else bends like its carrier.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "animation/rays/evidence.h"
#include "animation/rays/isometric_fit.h"

namespace weft {

struct PolishOptions {
  IsometricOptions fit;
  // Of a vertex alone; many together hold what no ray does. Chosen as the fit's numbers, with --carrier:
  // errors were 1 % larger with 300.
  double carrier_sigma_mm = 150;
  // Rays further from the cloth around them than this many spreads, and than a good part of an edge, are set
  // aside, before each round.
  int rounds = 2;
  double outlier_spreads = 5;

  absl::Status Validate() const;
};

struct PolishedMesh {
  std::vector<Eigen::Vector3d> position_mm;  // [vertices]
  std::vector<bool> rejected;                // [rays]
};

// Not for use by two threads at once. The same bytes at any thread count.
class RayPolish {
 public:
  // Model and lengths must outlive it.
  RayPolish(const AlignmentModel& model, const EdgeLengths& lengths, const PolishOptions& options);

  // Minimises the squared distances from the rays, each over its sigma, with the lengths and bends of
  // IsometricFit and a weak pull to the carrier. `start_mm` decides which way a bump goes that rays leave
  // open. Rays are ordered by vertex. Errors of IsometricFit.
  absl::StatusOr<PolishedMesh> Polish(const std::vector<Eigen::Vector3d>& carrier_mm,
                                      const std::vector<Eigen::Vector3d>& start_mm,
                                      const std::vector<VertexRay>& rays);

 private:
  const AlignmentModel& model_;
  PolishOptions options_;
  IsometricFit fit_;
};

}  // namespace weft
