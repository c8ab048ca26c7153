// Checks of a calibration that was solved (checks.h).
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/median.h"
#include "capture/calibration/checks.h"
#include "capture/calibration/covisibility.h"

namespace weft {
namespace {

// The frames over which most of a camera's views fit no other camera: [first, last] among `fates`, those that
// do not fit less four times those that do. Nothing where none do not.
struct Stretch {
  size_t first = 0, last = 0;
  int rejected = 0, all = 0;
};
std::optional<Stretch> WorstStretch(const std::vector<SharedViewFate>& fates) {
  constexpr int kFitting = -4;
  std::optional<Stretch> worst;
  int best = 0, sum = 0;
  size_t first = 0;
  for (size_t i = 0; i < fates.size(); ++i) {
    if (sum <= 0) sum = 0, first = i;
    sum += fates[i].is_rejected ? 1 : kFitting;
    if (sum > best) best = sum, worst = Stretch{first, i};
  }
  if (!worst) return worst;
  for (size_t i = worst->first; i <= worst->last; ++i) worst->rejected += fates[i].is_rejected;
  worst->all = static_cast<int>(worst->last - worst->first + 1);
  return worst;
}

// When a camera was at odds with the others, in words; empty where it never was for long.
std::string WhenChanged(const CalibrationSolution& solution, int camera,
                        const CalibrationCheckOptions& options) {
  std::vector<SharedViewFate> fates;
  for (const SharedViewFate& fate : solution.shared_views)
    if (fate.camera == camera) fates.push_back(fate);
  const auto far = std::count_if(fates.begin(), fates.end(), [](const auto& f) { return f.is_far; });
  const std::optional<Stretch> worst = WorstStretch(fates);
  if (worst && worst->rejected >= options.min_changed_views)
    return absl::StrCat("from frame ", solution.frames[fates[worst->first].frame], " to ",
                        solution.frames[fates[worst->last].frame], " ", worst->rejected, " of its ",
                        worst->all, " views");
  const bool is_scattered = static_cast<double>(far) >
                            std::max<double>(options.min_changed_views,
                                             options.max_rejected_share * static_cast<double>(fates.size()));
  return is_scattered ? absl::StrCat(far, " of its ", fates.size(), " views") : "";
}

// Cameras of a rig stand neither at the board nor beyond the hall.
void CheckUnit(const CalibrationTarget& target, const CalibrationSolution& solution,
               std::vector<CalibrationIssue>& out) {
  constexpr double kNearest_mm = 150, kFarthest_mm = 100'000;
  std::vector<double> distances_mm;
  for (const BundleView& view : solution.bundle.views)
    distances_mm.push_back((CameraFromWorld(solution.bundle.cameras[view.camera]) *
                            solution.bundle.placements[view.placement].world_from_board)
                               .translation_mm.norm());
  const double median_mm = Median(std::move(distances_mm));
  if (target.boards.empty() || (median_mm >= kNearest_mm && median_mm <= kFarthest_mm)) return;
  const double tag_mm =
      solution.bundle.boards.empty() ? target.boards[0].tag_mm : solution.bundle.boards[0].tag_mm;
  out.push_back({CalibrationFault::kWrongUnit,
                 {},
                 absl::StrFormat(
                     "the cameras are %.4g mm from the boards in the median, by tags of %g mm: is tag_mm of "
                     "target.json, or a bar's length_mm, in another unit? Lengths are in mm; measure a tag",
                     median_mm, tag_mm)});
}

// How a camera fits, the first fault alone. `limit_px` of the residual follows from the median of all
// cameras.
void CheckCamera(const CalibrationSolution& solution, int camera, double median_px, double limit_px,
                 const CalibrationCheckOptions& options, std::vector<CalibrationIssue>& out) {
  const CameraFit& fit = solution.cameras[camera];
  const std::string who = absl::StrCat("camera ", solution.bundle.cameras[camera].id);
  const int corners = fit.corners + fit.rejected_corners;
  const std::string changed = WhenChanged(solution, camera, options);
  const std::string when =
      changed.empty() ? "" : absl::StrCat("; ", changed, " do not fit what others saw at that moment");
  if (fit.rms_px > limit_px) {
    out.push_back(
        {CalibrationFault::kHighResidual,
         {camera},
         absl::StrFormat(
             "%s: reprojection error of %.2f px over %d views, at most %.2f px are accepted (the median "
             "camera has %.2f px); was it moved, out of sync, or the board bent?%s",
             who, fit.rms_px, fit.views, limit_px, median_px, when)});
  } else if (10 * fit.rejected_corners > 3 * corners) {
    out.push_back(
        {CalibrationFault::kHighResidual,
         {camera},
         absl::StrFormat("%s: %d of %d corners do not fit the others; was it moved or out of sync?%s", who,
                         fit.rejected_corners, corners, when)});
  } else if (!changed.empty()) {
    out.push_back(
        {CalibrationFault::kChanged,
         {camera},
         absl::StrCat(who, ": ", changed,
                      " do not fit what other cameras saw at the same moment; was it turned, moved, "
                      "out of sync, or are those pictures another camera's? Record again, or leave "
                      "those frames out")});
  } else if (fit.projection_sigma_px > options.max_projection_sigma_px) {
    out.push_back(
        {CalibrationFault::kUncertain,
         {camera},
         absl::StrFormat("%s: projection uncertainty of %.2f px on the stage, at most %.2f px are accepted; "
                         "show it more boards (it has %d views), tilted, near and far, with its neighbours",
                         who, fit.projection_sigma_px, options.max_projection_sigma_px, fit.views)});
  }
}

// Bars whose length does not fit the size of the tags, where these give the scale.
void CheckBars(const CalibrationTarget& target, const CalibrationSolution& solution, bool scale_from_bar,
               const CalibrationCheckOptions& options, std::vector<CalibrationIssue>& out) {
  for (const ScaleBarFit& fit : solution.bars) {
    const ScaleBar& bar = target.scale_bars[fit.bar];
    const double error = fit.length_mm / bar.length_mm - 1;
    if (scale_from_bar ||
        std::abs(error) <= std::max(options.max_scale_error, 4 * fit.sigma_mm / bar.length_mm))
      continue;
    out.push_back(
        {CalibrationFault::kWrongScale,
         {},
         absl::StrFormat(
             "scale bar %s: %.2f mm by the size of the boards' tags, but target.json says %.2f mm: the "
             "tags were printed at %.2f %% of tag_mm; measure them and correct target.json, or take "
             "the scale from the bar",
             bar.id, fit.length_mm, bar.length_mm, 100 / (1 + error))});
  }
}

}  // namespace

std::vector<CalibrationIssue> CheckSolution(const CalibrationTarget& target,
                                            const CalibrationSolution& solution, bool scale_from_bar,
                                            const CalibrationCheckOptions& options) {
  std::vector<CalibrationIssue> out;
  CheckUnit(target, solution, out);
  std::vector<double> rms;
  for (const CameraFit& fit : solution.cameras) rms.push_back(fit.rms_px);
  const double median_px = Median(std::move(rms));
  const double limit_px = std::min(options.max_rms_px, std::max(0.2, options.max_rms_ratio * median_px));
  for (size_t c = 0; c < solution.cameras.size(); ++c)
    CheckCamera(solution, static_cast<int>(c), median_px, limit_px, options, out);
  CheckBars(target, solution, scale_from_bar, options, out);
  return out;
}

}  // namespace weft
