// The page of a calibration.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "capture/calibration/covisibility.h"
#include "services/results/report/html_text.h"
#include "services/results/report/plot.h"
#include "services/results/report/report_sections.h"
#include "services/results/report/verdict_html.h"
#include "services/studio/calibration/calibrate_dump.h"
#include "services/studio/calibration/report_drawings.h"

namespace weft {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegPerRad = 180 / std::numbers::pi;

std::string Tile(const std::string& label, const std::string& value, const std::string& small) {
  return absl::StrCat("<div class=\"tile\"><span>", label, "</span><b>", value, "</b><small>", small,
                      "</small></div>\n");
}

std::string Head(const CalibrationResult& result) {
  std::string out;
  if (!result.provenance.empty()) absl::StrAppend(&out, "<p>", EscapeHtml(result.provenance), ".</p>\n");
  out += "<div class=\"tiles\">\n";
  out += Tile("Frames", FormatCount(static_cast<int64_t>(result.detection.views.frames.size())),
              absl::StrCat(FormatCount(static_cast<int64_t>(result.detection.views.boards.size())),
                           " views of boards"));
  out += Tile("Detection", FormatDuration(1000 * result.detection_s), "");
  if (result.solution) {
    const CalibrationSolution& s = *result.solution;
    const WorstCamera worst = WorstCameraOf(result);
    out += Tile("Solution", FormatDuration(1000 * result.solution_s),
                absl::StrCat(s.iterations, " iterations", s.converged ? "" : ", not converged"));
    out += Tile(
        "Reprojection error", FormatNumber(s.rms_px, 3) + "\xC2\xA0px",
        absl::StrCat("variance factor ", FormatNumber(s.variance_factor, 3), ", 1 for a model that fits"));
    out += Tile("Projection uncertainty", FormatNumber(worst.sigma_px, 3) + "\xC2\xA0px",
                absl::StrCat("at most, of a known point on the stage, in camera ", NameHtml(worst.id)));
    const Eigen::Vector3d stage = s.stage_high_mm - s.stage_low_mm;
    out += Tile("Stage",
                absl::StrCat(FormatNumber(stage.x() / 1000, 2), " x ", FormatNumber(stage.y() / 1000, 2),
                             " x ", FormatNumber(stage.z() / 1000, 2)),
                "m that the boards were moved through");
    out += Tile("Rig", absl::StrCat("version ", result.record.version),
                absl::StrCat(EscapeHtml(result.rig.id), " ", result.rig.ContentHash()));
  }
  return PageHead("Weft rig calibration", CalibrationHeadline(result) + ".", CalibrationVerdict(result),
                  out + "</div>\n");
}

std::string List(const std::string& id, const std::string& heading, const std::vector<std::string>& items,
                 size_t most) {
  if (items.empty()) return "";
  std::string body = "<ul class=\"warnings\">\n";
  for (size_t i = 0; i < std::min(most, items.size()); ++i)
    absl::StrAppend(&body, "<li>", EscapeHtml(items[i]), "</li>\n");
  if (items.size() > most) absl::StrAppend(&body, "<li>and ", items.size() - most, " more</li>\n");
  return Section(id, heading, body + "</ul>\n");
}

std::string Issues(const CalibrationResult& result) {
  std::vector<std::string> messages;
  for (const CalibrationIssue& issue : result.issues) messages.push_back(issue.message);
  return List("warnings", "Why it is refused", messages, 60) +
         List("images", "Images that could not be read", result.detection.warnings, 8);
}

// Ten lengths that keep lines of typical residuals visible.
double Magnification(const CalibrationResult& result) {
  if (!result.solution) return 1;
  const double wanted = 60 / std::max(1e-3, result.solution->rms_px);
  return std::pow(10, std::floor(std::log10(wanted))) *
         (wanted / std::pow(10, std::floor(std::log10(wanted))) >= 5 ? 5 : 1);
}

std::string Images(const CalibrationResult& result) {
  const double magnified = Magnification(result);
  const std::string what =
      result.solution
          ? absl::StrCat("Lines are reprojection errors of some corners, ",
                         FormatCount(std::llround(magnified)),
                         " times their length: directions at random are noise, a common direction in one "
                         "region is a lens that is not known there. ")
          : "Dots are corners of boards. ";
  return Section("coverage", "Corners in each camera",
                 absl::StrCat("<p>", what, "Parts of an image without any corner are shaded.</p>\n",
                              ImagePanels(result, magnified)));
}

std::string Links(const CalibrationResult& result) {
  return Section(
      "covisibility", "Cameras that see the same boards",
      absl::StrCat(
          "<div class=\"plots drawings\">\n", LinkMatrix(result), LinkDrawing(result, FromAbove()),
          LinkDrawing(result, FromTheSide()),
          "</div>\n<p>The more boards two cameras share, the darker their square and line. Dots are the "
          "boards.</p>\n"));
}

std::string Plots(const CalibrationResult& result) {
  if (!result.solution) return "";
  PlotFrames axis;
  axis.noun = "camera";
  std::vector<double> rms, projection;
  const std::vector<int> seen = ViewsOfBoards(result.detection.views);
  const std::vector<double> views(seen.begin(), seen.end());
  for (size_t c = 0; c < result.solution->cameras.size(); ++c) {
    const CameraFit& fit = result.solution->cameras[c];
    axis.names.push_back(result.detection.views.cameras[c].id);
    axis.without_mesh.push_back(false);
    rms.push_back(fit.rms_px);
    projection.push_back(fit.projection_sigma_px);
  }
  return Section(
      "plots", "By camera",
      absl::StrCat(
          "<div class=\"plots\">\n",
          LinePlot(axis, rms, {.title = "Reprojection error, px", .unit = "px", .decimals = 3}),
          LinePlot(axis, projection,
                   {.title = "Projection uncertainty over the stage, px", .unit = "px", .decimals = 3}),
          LinePlot(axis, views, {.title = "Views of boards"}), "</div>\n"));
}

// What detection found, and what came of it.
std::string Cameras(const CalibrationResult& result) {
  const std::vector<int> shared = SharedViews(result.detection.views);
  const std::vector<int> views = ViewsOfBoards(result.detection.views);
  std::string rows;
  for (size_t c = 0; c < result.detection.views.cameras.size(); ++c) {
    const CameraSightings& seen = result.detection.sightings[c];
    std::vector<std::string> cells = {NameHtml(result.detection.views.cameras[c].id)};
    for (const int count :
         {seen.images, views[c], shared[c], seen.tags, seen.small_tags, seen.blurred_tags, seen.unclear_tags})
      cells.push_back(FormatCount(count));
    if (result.solution) {
      const CameraFit& fit = result.solution->cameras[c];
      cells.push_back(FormatCount(fit.views));
      cells.push_back(FormatCount(fit.corners));
      cells.push_back(FormatCount(fit.rejected_corners));
      cells.push_back(FormatNumber(fit.rms_px, 3));
    }
    rows += TableRow("td", cells);
  }
  std::vector<std::string> header = {"Camera",    "Images",    "Views",   "Shared",
                                     "Tags used", "Too small", "Blurred", "Unclear"};
  if (result.solution)
    header.insert(header.end(), {"Views used", "Corners", "Rejected", "Reprojection error, px"});
  return Section("cameras", "Cameras",
                 absl::StrCat("<p>Views are boards in images; shared ones were seen by another camera at the "
                              "same moment, used ones are in the solution. Tags are left out where they are "
                              "too small to measure, blurred, or "
                              "unclear: hidden in part, or without contrast.</p>\n",
                              Table(header, rows, "cameras")));
}

// The lenses and how well all is known.
std::string Sigmas(const CalibrationResult& result) {
  if (!result.solution) return "";
  std::string rows;
  for (size_t c = 0; c < result.solution->cameras.size(); ++c) {
    const CameraFit& fit = result.solution->cameras[c];
    const CameraModel& camera = result.solution->bundle.cameras[c];
    const auto sigma = [&](int i) { return fit.covariance.size() ? std::sqrt(fit.covariance(i, i)) : kNaN; };
    const auto longest = [&](int i) { return std::hypot(sigma(i), sigma(i + 1), sigma(i + 2)); };
    const auto with_sigma = [&](double value, int i, int decimals) {
      return absl::StrCat(FormatNumber(value, decimals), "&nbsp;&plusmn;&nbsp;",
                          FormatNumber(sigma(i), decimals));
    };
    rows +=
        TableRow("td", {NameHtml(camera.id), with_sigma(camera.fx_px, 0, 2), with_sigma(camera.cx_px, 2, 2),
                        with_sigma(camera.cy_px, 3, 2), with_sigma(camera.distortion[0], 4, 4),
                        FormatNumber(longest(9) * kDegPerRad, 4), FormatNumber(longest(12), 3),
                        FormatNumber(fit.sigma_px, 3), FormatNumber(fit.projection_sigma_px, 3)});
  }
  return Section("sigmas", "Lenses and sigmas",
                 Table({"Camera", "fx, px", "cx, px", "cy, px", "k1", "Rotation, deg", "Centre, mm",
                        "Corner, px", "Projection, px"},
                       rows, "cameras"));
}

std::string Boards(const CalibrationResult& result) {
  if (!result.solution) return "";
  std::string rows;
  for (size_t b = 0; b < result.solution->bundle.warps.size(); ++b) {
    const BoardWarp& warp = result.solution->bundle.warps[b];
    const TagBoard& board = result.target.boards[b];
    rows += TableRow(
        "td", {NameHtml(board.id), absl::StrCat(board.rows, " x ", board.cols), FormatNumber(board.tag_mm, 3),
               FormatNumber(warp.bend_xx_mm, 2), FormatNumber(warp.bend_xy_mm, 2),
               FormatNumber(warp.bend_yy_mm, 2), FormatNumber(100 * warp.stretch, 3)});
  }
  std::string body =
      Table({"Board", "Tags", "Tag, mm", "Bend along x, mm", "Twist, mm", "Bend along y, mm", "Stretch, %"},
            rows, "cameras");
  if (!result.solution->bars.empty()) {
    rows.clear();
    for (const ScaleBarFit& fit : result.solution->bars) {
      const ScaleBar& bar = result.target.scale_bars[fit.bar];
      rows += TableRow(
          "td", {NameHtml(bar.id), FormatNumber(bar.length_mm, 3), FormatNumber(fit.length_mm, 3),
                 FormatNumber(fit.sigma_mm, 3), FormatNumber(100 * (fit.length_mm / bar.length_mm - 1), 3),
                 FormatCount(fit.frames)});
    }
    body += "<h3>Scale bars</h3>\n" +
            Table({"Bar", "Length, mm", "Measured by tag sizes, mm", "Sigma, mm", "Difference, %", "Frames"},
                  rows, "cameras");
  }
  return Section("boards", "Boards", body);
}

}  // namespace

std::string MakeCalibrationReport(const CalibrationResult& result) {
  return Page("Weft rig calibration",
              absl::StrCat(Head(result), Issues(result), Plots(result), Images(result), Links(result),
                           Cameras(result), Sigmas(result), Boards(result)));
}

}  // namespace weft
