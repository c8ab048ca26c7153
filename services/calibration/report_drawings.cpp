#include "services/calibration/report_drawings.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/calibration/covisibility.h"
#include "services/report/html_text.h"

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
      "%s\">%s</svg>"
      "<figcaption>%s</figcaption></figure>\n",
      width + 4, height + 4, width + 4, NameHtml(size.id), body, caption);
}

// World to paper.
class Paper {
 public:
  Paper(const CalibrationResult& result, int right, int down) : right_(right), down_(down) {
    for (const CameraModel& camera : result.solution->bundle.cameras) Hold(camera.CenterWorld());
    Hold(result.solution->stage_low_mm);
    Hold(result.solution->stage_high_mm);
  }
  Eigen::Vector2d At(const Eigen::Vector3d& world) const {
    return (On(world) - low_) * kSize / std::max(1.0, (high_ - low_).maxCoeff()) +
           Eigen::Vector2d(kMargin, kMargin);
  }
  Eigen::Vector2d On(const Eigen::Vector3d& world) const { return {world[right_], world[down_]}; }
  Eigen::Vector2d size() const {
    return (high_ - low_) * kSize / std::max(1.0, (high_ - low_).maxCoeff()) +
           2 * Eigen::Vector2d(kMargin, kMargin);
  }

 private:
  static constexpr double kSize = 500, kMargin = 18;
  void Hold(const Eigen::Vector3d& world) {
    low_ = low_.cwiseMin(On(world));
    high_ = high_.cwiseMax(On(world));
  }
  int right_, down_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high_ = -low_;
};

}  // namespace

std::string ImagePanels(const CalibrationResult& result, double magnified) {
  std::string out = "<div style=\"display:flex;flex-wrap:wrap;gap:10px 14px\">\n";
  for (size_t c = 0; c < result.detection.views.cameras.size(); ++c) {
    out += ImagePanel(result, static_cast<int>(c), magnified);
  }
  return out + "</div>\n";
}

std::string LinkDrawing(const CalibrationResult& result, const std::string& title, int right, int down) {
  if (!result.solution) return "";
  const std::vector<CameraModel>& cameras = result.solution->bundle.cameras;
  const Paper paper(result, right, down);
  std::string body;
  for (const BoardPlacement& p : result.solution->bundle.placements) {
    const Eigen::Vector2d at = paper.At(p.world_from_board.translation_mm);
    absl::StrAppendFormat(&body, "<circle class=\"range\" cx=\"%.1f\" cy=\"%.1f\" r=\"3\"/>", at.x(), at.y());
  }
  const Covisibility covisibility = CountSharedViews(result.detection.views);
  std::vector<std::tuple<int, size_t, size_t>> links;
  for (size_t a = 0; a < cameras.size(); ++a) {
    for (size_t b = a + 1; b < cameras.size(); ++b) {
      if (covisibility.shared[a][b] > 0) links.emplace_back(covisibility.shared[a][b], a, b);
    }
  }
  std::sort(links.rbegin(), links.rend());
  constexpr size_t kMostLinks = 900;
  if (links.size() > kMostLinks) links.resize(kMostLinks);
  for (const auto& [shared, a, b] : links) {
    const Eigen::Vector2d from = paper.At(cameras[a].CenterWorld()), to = paper.At(cameras[b].CenterWorld());
    absl::StrAppendFormat(&body,
                          "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"var(--accent)\" "
                          "stroke-opacity=\"%.2f\"><title>%s and %s: %d boards</title></line>",
                          from.x(), from.y(), to.x(), to.y(),
                          0.08 + 0.6 * shared / std::get<0>(links.front()), NameHtml(cameras[a].id),
                          NameHtml(cameras[b].id), shared);
  }
  for (size_t c = 0; c < cameras.size(); ++c) {
    const Eigen::Vector2d at = paper.At(cameras[c].CenterWorld()),
                          look = 12 * paper.On(cameras[c].rotation.row(2).transpose());
    const Eigen::Vector2d side(-0.45 * look.y(), 0.45 * look.x());
    absl::StrAppendFormat(
        &body,
        "<path d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fz\" fill=\"var(--ink)\"><title>%s: %d views"
        "</title></path>",
        at.x(), at.y(), at.x() + look.x() + side.x(), at.y() + look.y() + side.y(),
        at.x() + look.x() - side.x(), at.y() + look.y() - side.y(), NameHtml(cameras[c].id),
        covisibility.shared[c][c]);
  }
  const Eigen::Vector2d size = paper.size();
  return absl::StrFormat(
      "<figure class=\"plot\"><figcaption>%s</figcaption><svg viewBox=\"0 0 %.0f %.0f\" role=\"img\" "
      "aria-label=\"%s\">%s"
      "</svg></figure>\n",
      title, size.x(), size.y(), title, body);
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
      "%d)</figcaption>"
      "<svg viewBox=\"0 0 524 484\" role=\"img\" aria-label=\"covisibility\"><rect x=\"40\" width=\"480\" "
      "height=\"480\" "
      "fill=\"none\" stroke=\"var(--line)\"/>%s</svg></figure>\n",
      most, body);
}

}  // namespace weft
