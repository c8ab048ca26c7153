// The section about cameras.
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"
#include "services/results/report/plot.h"
#include "services/results/report/report_sections.h"

namespace weft {
namespace {

constexpr size_t kReasonColumns = 5;
constexpr size_t kShownReasons = 3;
// Decoding itself leaves some hundredths of a pixel, which many cells make significant.
constexpr double kSignificantBias = 4, kNotableBiasPx = 0.1;

double PerFrame(int64_t count, const CameraSummary& camera) {
  return camera.frames_seen > 0 ? static_cast<double>(count) / camera.frames_seen : 0;
}

std::string PerFrameText(int64_t count, const CameraSummary& camera) {
  if (camera.frames_seen == 0) return kDash;
  const double mean = PerFrame(count, camera);
  return camera.frames_seen > 1 && count > 0 && mean < 9.95 ? FormatNumber(mean, 1)
                                                            : FormatCount(std::llround(mean));
}

// Most frequent first; then "and N similar".
std::string MissingText(const CameraSummary& camera) {
  std::vector<std::pair<std::string, int>> reasons(camera.missing_reasons.begin(),
                                                   camera.missing_reasons.end());
  std::ranges::stable_sort(reasons, [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string html;
  for (size_t i = 0; i < reasons.size() && i < kShownReasons; ++i) {
    const std::string times =
        reasons[i].second > 1 ? absl::StrCat(" (", Counted(reasons[i].second, "frame", "frames"), ")") : "";
    absl::StrAppend(&html, i > 0 ? "<br>" : "", EscapeHtml(reasons[i].first), times);
  }
  if (reasons.size() > kShownReasons) {
    absl::StrAppend(&html, "<br>and ", FormatCount(static_cast<int64_t>(reasons.size() - kShownReasons)),
                    " more");
  }
  return html;
}

std::string MissingCameras(const std::vector<CameraSummary>& cameras) {
  std::string rows;
  for (const CameraSummary& camera : cameras) {
    if (camera.frames_missing == 0) continue;
    const int all = camera.frames_missing + camera.frames_seen;
    rows += TableRow("td", {NameHtml(camera.camera),
                            absl::StrCat(FormatCount(camera.frames_missing), " of ", FormatCount(all)),
                            MissingText(camera)});
  }
  if (rows.empty()) return "<p>Every camera gave a usable image in every frame.</p>\n";
  return "<h3>Without a usable image</h3>\n" + Table({"Camera", "Frames", "Why"}, rows, "missing");
}

// Of cameras that nothing triggered together.
std::string MovedCameras(const std::vector<CameraSummary>& cameras) {
  std::string rows;
  for (const CameraSummary& camera : cameras) {
    if (camera.frames_moved == 0) continue;
    rows += TableRow("td",
                     {NameHtml(camera.camera),
                      absl::StrCat(FormatCount(camera.frames_moved), " of ", FormatCount(camera.frames_seen)),
                      FormatNumber(camera.longest_move_ms, 1)});
  }
  if (rows.empty()) return "";
  return "<h3>Taken at another moment</h3>\n<p>These observations were moved to the moment of their frame, "
         "by the "
         "cloth's motion to the camera's next or last image.</p>\n" +
         Table({"Camera", "Frames", "At most, ms"}, rows, "moved");
}

// The most frequent reasons over all cameras.
std::vector<std::string> MainReasons(const std::vector<CameraSummary>& cameras) {
  std::map<std::string, int64_t> totals;
  for (const CameraSummary& camera : cameras) {
    for (const auto& [reason, count] : camera.patches_rejected) totals[reason] += count;
  }
  std::vector<std::pair<std::string, int64_t>> sorted(totals.begin(), totals.end());
  std::ranges::stable_sort(sorted, [](const auto& a, const auto& b) { return a.second > b.second; });
  std::vector<std::string> reasons;
  for (size_t i = 0; i < sorted.size() && i < kReasonColumns; ++i) reasons.push_back(sorted[i].first);
  return reasons;
}

// How far the camera sees nodes from where the others do; marked where it is hardly chance.
std::string BiasText(const CameraSummary& camera) {
  if (camera.frames_with_bias == 0) return kDash;
  const double length_px = std::hypot(camera.bias_x_px, camera.bias_y_px);
  const std::string text =
      absl::StrCat(FormatNumber(length_px, 2), " (", FormatNumber(camera.bias_significance, 1), " \xCF\x83)");
  const bool off = camera.bias_significance > kSignificantBias && length_px > kNotableBiasPx;
  return off ? absl::StrCat("<b>", text, "</b>") : text;
}

std::string CameraRow(const CameraSummary& camera, const std::vector<std::string>& reasons, bool has_others,
                      double most_centers) {
  const double share = most_centers > 0 ? PerFrame(camera.centers, camera) / most_centers : 0;
  std::vector<std::string> cells = {
      NameHtml(camera.camera),
      absl::StrCat(FormatCount(camera.frames_seen), " of ",
                   FormatCount(camera.frames_seen + camera.frames_missing)),
      PerFrameText(camera.centers, camera) +
          absl::StrFormat("<i class=\"bar\"><i style=\"width:%.1f%%\"></i></i>", 100 * share),
      PerFrameText(camera.corners, camera),
      PerFrameText(camera.patches_accepted, camera),
      FormatNumber(camera.residual_px, 2),
      BiasText(camera),
      camera.grey_levels.empty() ? kDash : FormatNumber(MedianOf(camera.grey_levels), 0)};
  int64_t others = 0;
  for (const auto& [reason, count] : camera.patches_rejected) others += count;
  for (const std::string& reason : reasons) {
    const auto entry = camera.patches_rejected.find(reason);
    const int64_t count = entry == camera.patches_rejected.end() ? 0 : entry->second;
    others -= count;
    cells.push_back(PerFrameText(count, camera));
  }
  if (has_others) cells.push_back(PerFrameText(others, camera));
  return TableRow("td", cells);
}

std::string ResidualPlot(const std::vector<CameraSummary>& cameras) {
  PlotFrames axis;
  axis.noun = "camera";
  std::vector<double> residuals;
  bool any = false;
  for (const CameraSummary& camera : cameras) {
    axis.names.push_back(camera.camera);
    residuals.push_back(camera.residual_px);
    any = any || std::isfinite(camera.residual_px);
  }
  axis.without_mesh.assign(axis.names.size(), false);
  if (!any) return "";
  return absl::StrCat(
      "<div class=\"plots\">\n",
      BarPlot(axis, residuals,
              {.title = "Reprojection residual per camera, RMS, px", .unit = "px", .decimals = 3}),
      "</div>\n");
}

}  // namespace

std::string CameraSection(const JobSummary& summary) {
  if (summary.cameras.empty()) return "";
  const std::vector<std::string> reasons = MainReasons(summary.cameras);
  bool has_others = false;
  double most_centers = 0;
  for (const CameraSummary& camera : summary.cameras) {
    most_centers = std::max(most_centers, PerFrame(camera.centers, camera));
    for (const auto& [reason, count] : camera.patches_rejected) {
      has_others |= std::ranges::find(reasons, reason) == reasons.end();
    }
  }
  std::vector<std::string> header = {"Camera",       "Frames",       "Cells seen", "Corners seen",
                                     "Patches read", "Residual, px", "Off by, px", "Grey levels"};
  for (const std::string& reason : reasons) header.push_back("Rejected: " + EscapeHtml(Words(reason)));
  if (has_others) header.push_back("Rejected: other reasons");
  std::string rows;
  for (const CameraSummary& camera : summary.cameras)
    rows += CameraRow(camera, reasons, has_others, most_centers);
  return Section(
      "cameras", "Cameras",
      absl::StrCat(
          MissingCameras(summary.cameras), MovedCameras(summary.cameras),
          "<h3>Contribution of each camera</h3>\n<p>Means per frame in which the camera gave an "
          "image. A patch is a connected piece of the pattern; it is rejected as a whole. "
          "<i>Residual</i> is the RMS distance of the camera's observations to the points as all "
          "other cameras see them, so it is a reprojection error that cannot hide in the point. <i>Off "
          "by</i> is how far a camera sees the cloth from where all others see it, with its "
          "significance: in bold where the camera moved or its calibration is off. <i>Grey levels</i> are "
          "those that "
          "the print spans, from its black lines to its brightest ink.</p>\n",
          Table(header, rows, "cameras"), ResidualPlot(summary.cameras)));
}

}  // namespace weft
