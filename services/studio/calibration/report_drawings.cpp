#include "services/studio/calibration/report_drawings.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/calibration/covisibility.h"
#include "services/results/report/html_text.h"
#include "services/results/report/rig_drawing.h"

namespace weft {
namespace {

constexpr double kPanelPx = 150;
constexpr size_t kLinesPerPanel = 160;

// Lines of one camera, spread over all of its corners.
std::string ResidualLines(const CalibrationSolution& solution, int camera, double scale, double magnified) {
  size_t corners = 0;
  for (const BundleView& view : solution.bundle.views) {
    if (view.camera == camera) corners += view.corners.size();
  }
  const size_t step = std::max<size_t>(1, corners / kLinesPerPanel);
  std::string path;
  size_t index = 0;
  for (const BundleView& view : solution.bundle.views) {
    if (view.camera != camera) continue;
    const std::vector<Eigen::Vector2d> residuals = ViewResiduals(solution.bundle, view);
    for (size_t i = 0; i < residuals.size(); ++i, ++index) {
      if (index % step != 0) continue;
      const Eigen::Vector2d at = scale * view.corners[i].pixel_px, way = scale * magnified * residuals[i];
      absl::StrAppendFormat(&path, "M%.1f %.1fl%.1f %.1f", at.x(), at.y(), way.x(), way.y());
    }
  }
  return path;
}

// Corners as dots where there is no solution.
std::string CornerDots(const CalibrationViews& views, int camera, double scale) {
  size_t corners = 0;
  for (const BoardView& view : views.boards) {
    if (view.camera == camera) corners += view.corners.size();
  }
  const size_t step = std::max<size_t>(1, corners / kLinesPerPanel);
  std::string path;
  size_t index = 0;
  for (const BoardView& view : views.boards) {
    if (view.camera != camera) continue;
    for (const BoardCorner& corner : view.corners) {
      if (index++ % step == 0) {
        absl::StrAppendFormat(&path, "M%.1f %.1fh1", scale * corner.pixel_px.x(),
                              scale * corner.pixel_px.y());
      }
    }
  }
  return path;
}

std::string ImagePanel(const CalibrationResult& result, int camera, double magnified) {
  const CalibrationCamera& size = result.detection.views.cameras[camera];
  const double scale = kPanelPx / std::max(size.width_px, size.height_px);
  const double width = scale * size.width_px, height = scale * size.height_px;
  std::string body = absl::StrFormat(
      "<rect width=\"%.1f\" height=\"%.1f\" fill=\"none\" stroke=\"var(--line)\"/>", width, height);
  const std::array<int, 9> coverage = CornerCoverage(result.detection.views, camera);
  for (int i = 0; i < 9; ++i) {
    if (coverage[i] > 0) continue;
    absl::StrAppendFormat(
        &body,
        "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"var(--bad)\" opacity=\"0.18\"/>",
        width / 3 * (i % 3), height / 3 * (i / 3), width / 3, height / 3);
  }
  const std::string path = result.solution ? ResidualLines(*result.solution, camera, scale, magnified)
                                           : CornerDots(result.detection.views, camera, scale);
  absl::StrAppendFormat(&body, "<path d=\"%s\" stroke=\"var(--accent)\" stroke-width=\"%s\" fill=\"none\"/>",
                        path, result.solution ? "0.8" : "1.4");
  std::string caption = NameHtml(size.id);
  if (result.solution) {
    absl::StrAppend(&caption, " <small>", FormatNumber(result.solution->cameras[camera].rms_px, 3),
                    " px</small>");
  }
  return absl::StrFormat(
      "<figure><svg viewBox=\"-2 -2 %.0f %.0f\" style=\"width:%.0fpx\" role=\"img\" aria-label=\"image of "
      "%s\">%s</svg><figcaption>%s</figcaption></figure>\n",
      width + 4, height + 4, width + 4, NameHtml(size.id), body, caption);
}

// Lines between cameras that share boards, the more the darker.
std::string LinkLines(const CalibrationResult& result, const RigDrawing& drawing) {
  constexpr size_t kMostLinks = 900;
  const std::vector<CameraModel>& cameras = result.solution->bundle.cameras;
  const Covisibility covisibility = CountSharedViews(result.detection.views);
  std::vector<std::tuple<int, size_t, size_t>> links;
  for (size_t a = 0; a < cameras.size(); ++a) {
    for (size_t b = a + 1; b < cameras.size(); ++b) {
      if (covisibility.shared[a][b] > 0) links.emplace_back(covisibility.shared[a][b], a, b);
    }
  }
  std::sort(links.rbegin(), links.rend());
  if (links.size() > kMostLinks) links.resize(kMostLinks);
  std::string svg;
  for (const auto& [shared, a, b] : links) {
    const Eigen::Vector2d from = drawing.Place(cameras[a].CenterWorld()),
                          to = drawing.Place(cameras[b].CenterWorld());
    absl::StrAppendFormat(&svg,
                          "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"var(--accent)\" "
                          "stroke-opacity=\"%.2f\"><title>%s and %s: %s</title></line>",
                          from.x(), from.y(), to.x(), to.y(),
                          0.08 + 0.6 * shared / std::get<0>(links.front()), EscapeHtml(cameras[a].id),
                          EscapeHtml(cameras[b].id), Counted(shared, "board", "boards"));
  }
  return svg;
}

}  // namespace

std::string ImagePanels(const CalibrationResult& result, double magnified) {
  std::string out = "<div class=\"panels\">\n";
  for (size_t c = 0; c < result.detection.views.cameras.size(); ++c) {
    out += ImagePanel(result, static_cast<int>(c), magnified);
  }
  return out + "</div>\n";
}

std::string LinkDrawing(const CalibrationResult& result, const PaperAxes& axes) {
  if (!result.solution) return "";
  const CalibrationSolution& solution = *result.solution;
  RigDrawing drawing(axes);
  for (const CameraModel& camera : solution.bundle.cameras) drawing.Hold(camera.CenterWorld());
  for (const Eigen::Vector3d& corner : {solution.stage_low_mm, solution.stage_high_mm}) drawing.Hold(corner);
  for (const BoardPlacement& p : solution.bundle.placements) {
    const Eigen::Vector2d at = drawing.Place(p.world_from_board.translation_mm);
    drawing.Add(absl::StrFormat("<circle class=\"range\" cx=\"%.1f\" cy=\"%.1f\" r=\"3\"/>", at.x(), at.y()));
  }
  drawing.Add(LinkLines(result, drawing));
  const std::vector<int> views = ViewsOfBoards(result.detection.views);
  for (size_t c = 0; c < solution.bundle.cameras.size(); ++c)
    drawing.AddCamera(solution.bundle.cameras[c], "camera",
                      absl::StrCat(": ", Counted(views[c], "view", "views")), true);
  return drawing.Figure();
}

std::vector<int> ViewsOfBoards(const CalibrationViews& views) {
  std::vector<int> count(views.cameras.size(), 0);
  for (const BoardView& view : views.boards) ++count[view.camera];
  return count;
}

std::string LinkMatrix(const CalibrationResult& result) {
  const std::vector<CalibrationCamera>& cameras = result.detection.views.cameras;
  constexpr size_t kMostCameras = 64;
  if (cameras.size() > kMostCameras) return "";
  const Covisibility covisibility = CountSharedViews(result.detection.views);
  int most = 1;
  for (size_t a = 0; a < cameras.size(); ++a) {
    for (size_t b = 0; b < a; ++b) most = std::max(most, covisibility.shared[a][b]);
  }
  const double cell = 480.0 / static_cast<double>(cameras.size());
  std::string body;
  for (size_t a = 0; a < cameras.size(); ++a) {
    for (size_t b = 0; b < cameras.size(); ++b) {
      if (a == b || covisibility.shared[a][b] == 0) continue;
      absl::StrAppendFormat(
          &body,
          "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"var(--accent)\" "
          "opacity=\"%.2f\"><title>%s and %s: %d boards</title></rect>",
          40 + b * cell, a * cell, cell - 0.5, cell - 0.5, 0.15 + 0.85 * covisibility.shared[a][b] / most,
          NameHtml(cameras[a].id), NameHtml(cameras[b].id), covisibility.shared[a][b]);
    }
    if (cell > 9) {
      absl::StrAppendFormat(&body, "<text class=\"tick\" x=\"36\" y=\"%.1f\" text-anchor=\"end\">%s</text>",
                            (a + 0.5) * cell + 4, EscapeHtml(Shortened(cameras[a].id, 6)));
    }
  }
  return absl::StrFormat(
      "<figure class=\"plot\"><figcaption>Boards that two cameras saw at the same moment (at most "
      "%d)</figcaption><svg viewBox=\"0 0 524 484\" role=\"img\" aria-label=\"covisibility\"><rect x=\"40\" "
      "width=\"480\" height=\"480\" fill=\"none\" stroke=\"var(--line)\"/>%s</svg></figure>\n",
      most, body);
}

}  // namespace weft
