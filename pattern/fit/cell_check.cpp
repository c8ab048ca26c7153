#include "pattern/fit/cell_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"

namespace weft {

std::string_view Describe(WhyMissing why) {
  static constexpr std::string_view kWords[kWhyMissing] = {
      "no print could be fitted",
      "not where its neighbours expect it",
      "does not look like the print",
      "another ink fits better",
      "too small",
      "position taken by another cell",
      "found, but not surely enough",
      "covered",
      "position not fixed by the image",
      "another part of the board fits as well",
  };
  return kWords[static_cast<int>(why)];
}

std::string_view NameOf(WhyMissing why) {
  static constexpr std::string_view kNames[kWhyMissing] = {"no_fit",    "moved", "not_explained", "other_ink",
                                                           "too_small", "taken", "unsure",        "covered",
                                                           "vague",     "rival"};
  return kNames[static_cast<int>(why)];
}

std::optional<WhyMissing> Reject(const CellFit& fit, const FitLimits& limits) {
  if (!fit.converged) {
    const bool given_up = fit.gain > 0 && fit.explained < limits.min_explained;
    return given_up ? WhyMissing::kNotExplained : WhyMissing::kNoFit;
  }
  if (fit.moved_cells > limits.max_move_cells) return WhyMissing::kMoved;
  if (fit.explained < limits.min_explained) return WhyMissing::kNotExplained;
  if (fit.ink_lead < limits.min_ink_lead * fit.center_contrast * fit.center_contrast)
    return WhyMissing::kOtherInk;
  if (fit.pose.Area() < limits.min_area_px || fit.pose.ShorterEdge() < limits.min_edge_px) {
    return WhyMissing::kTooSmall;
  }
  return std::nullopt;
}

absl::Status FitLimits::Validate(std::string_view prefix) const {
  const auto bad = [prefix](std::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat(absl::string_view(prefix.data(), prefix.size()), ".",
                                                   absl::string_view(what.data(), what.size())));
  };
  if (iterations < 1 || iterations > 50) return bad("iterations must lie in 1 to 50");
  if (!(min_explained > 0 && min_explained < 1)) return bad("min_explained must lie in (0, 1)");
  if (!(min_ink_lead >= 0 && min_ink_lead < 1)) return bad("min_ink_lead must lie in [0, 1)");
  if (!(max_move_cells > 0 && max_move_cells <= 3)) return bad("max_move_cells must lie in (0, 3]");
  if (!(min_edge_px >= 0)) return bad("min_edge_px must not be negative");
  if (!(min_area_px >= 0)) return bad("min_area_px must not be negative");
  return absl::OkStatus();
}

float SigmaOfImage(const CellFit& fit, float model_noise) {
  const float prior_precision = model_noise * model_noise / (kPositionPrior * kPositionPrior);
  const float pitch_px = std::sqrt(fit.pose.Area());
  const float in_noise_cells = fit.sigma_px / (std::max(fit.noise, 1e-3f) * pitch_px);
  const float precision = 1 / (in_noise_cells * in_noise_cells) - prior_precision;
  return precision > 0 ? pitch_px * fit.noise / std::sqrt(precision) : std::numeric_limits<float>::infinity();
}

}  // namespace weft
