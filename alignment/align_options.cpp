#include <cmath>

#include "absl/strings/str_cat.h"
#include "alignment/align.h"

namespace weft {
namespace {

absl::Status BadAlignment(const char* what) {
  return absl::InvalidArgumentError(absl::StrCat("alignment.", what));
}

}  // namespace

absl::Status DetectionOptions::Validate() const {
  if (!(reference_sigma_mm > 0)) return BadAlignment("detection.reference_sigma_mm must be positive");
  if (!(min_sigma_mm > 0)) return BadAlignment("detection.min_sigma_mm must be positive");
  if (!(cloth_sigma_mm >= 0)) return BadAlignment("detection.cloth_sigma_mm must not be negative");
  if (!(filled_weight >= 1e-6 && filled_weight <= 1e3)) {
    return BadAlignment("detection.filled_weight must lie in 1e-6 to 1000");
  }
  return absl::OkStatus();
}

absl::Status RobustOptions::Validate() const {
  if (max_rounds < 0) return BadAlignment("robust.max_rounds must not be negative");
  if (!(outlier_ratio > 1)) return BadAlignment("robust.outlier_ratio must be greater than 1");
  if (!(min_distance_mm >= 0)) return BadAlignment("robust.min_distance_mm must not be negative");
  return absl::OkStatus();
}

absl::Status ContinuationOptions::Validate() const {
  if (rings < 0) return BadAlignment("continuation.rings must not be negative");
  return absl::OkStatus();
}

absl::Status AlignOptions::Validate() const {
  if (!(min_target_share >= 0 && min_target_share <= 1))
    return BadAlignment("min_target_share must lie in 0 to 1");
  if (stretch_rings < 0) return BadAlignment("stretch_rings must not be negative");
  if (!(ray_reach_mm >= 0)) return BadAlignment("ray_reach_mm must not be negative");
  if (!(noise_sigmas >= 0)) return BadAlignment("noise_sigmas must not be negative");
  if (!(first_bending >= 0)) return BadAlignment("first_bending must not be negative");
  for (const absl::Status& status :
       {detection.Validate(), elastic.Validate(), continuation.Validate(), robust.Validate(), push.Validate(),
        recon.Validate(), layers.Validate(), untangle.Validate()}) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

RayFit RayFitOf(const AlignOptions& options) {
  return {.reach_mm = options.ray_reach_mm,
          .reference_sigma_mm = options.detection.reference_sigma_mm,
          .floor_mm = std::hypot(options.detection.min_sigma_mm, options.detection.cloth_sigma_mm),
          .edge_weight = options.elastic.lambda * options.elastic.distortion.stretch,
          .outlier_ratio = options.robust.outlier_ratio,
          .least_outlier_mm = options.robust.min_distance_mm};
}

}  // namespace weft
