// The page of a rig plan.
#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/evaluation/plan_rig.h"
#include "services/report/html_text.h"
#include "services/report/mesh_colors.h"
#include "services/report/picture_html.h"
#include "services/report/plot.h"
#include "services/report/report_sections.h"

namespace weft {
namespace {

// A picture of the rig along a world axis: `right` and `down` are the world axes of the paper.
struct Plane {
  const char* title;
  int right, down;
};

class RigDrawing {
 public:
  RigDrawing(const RigPlanResult& plan, const Plane& plane) : plan_(plan), plane_(plane) {
    for (const CameraModel& camera : plan.candidates.cameras) Hold(camera.CenterWorld());
    for (const Eigen::Vector3d& v : plan.garment.rest.vertices_mm) Hold(v);
  }

  std::string Svg() const {
    const double width = kScale * (high_.x() - low_.x()) / Extent() + 2 * kMargin,
                 height = kScale * (high_.y() - low_.y()) / Extent() + 2 * kMargin;
    std::string body;
    const std::vector<Eigen::Vector3d>& vertices = plan_.garment.rest.vertices_mm;
    const size_t step = std::max<size_t>(1, vertices.size() / 1500);
    for (size_t v = 0; v < vertices.size(); v += step) {
      const Eigen::Vector2d at = Place(vertices[v]);
      absl::StrAppendFormat(&body, "<circle class=\"range\" cx=\"%.1f\" cy=\"%.1f\" r=\"1.2\"/>", at.x(),
                            at.y());
    }
    for (const CameraModel& camera : plan_.candidates.cameras)
      if (plan_.rig.IndexOf(camera.id) < 0) body += Symbol(camera, false);
    for (const CameraModel& camera : plan_.rig.cameras) body += Symbol(camera, true);
    return absl::StrFormat(
        "<figure class=\"plot\"><figcaption>%s</figcaption><svg viewBox=\"0 0 %.0f %.0f\" role=\"img\" "
        "aria-label=\"%s\">%s</svg></figure>\n",
        plane_.title, width, height, plane_.title, body);
  }

 private:
  static constexpr double kScale = 520, kMargin = 16, kSymbol = 12;

  Eigen::Vector2d OnPaper(const Eigen::Vector3d& world) const {
    return {world[plane_.right], world[plane_.down]};
  }
  void Hold(const Eigen::Vector3d& world) {
    low_ = low_.cwiseMin(OnPaper(world));
    high_ = high_.cwiseMax(OnPaper(world));
  }
  double Extent() const { return std::max(1.0, (high_ - low_).maxCoeff()); }
  Eigen::Vector2d Place(const Eigen::Vector3d& world) const {
    return (OnPaper(world) - low_) * kScale / Extent() + Eigen::Vector2d(kMargin, kMargin);
  }
  // A wedge that opens to where the camera looks.
  std::string Symbol(const CameraModel& camera, bool chosen) const {
    const Eigen::Vector2d at = Place(camera.CenterWorld());
    const Eigen::Vector2d look = kSymbol * OnPaper(camera.rotation.row(2).transpose());
    const Eigen::Vector2d side(-0.45 * look.y(), 0.45 * look.x());
    const Eigen::Vector2d a = at + look + side, b = at + look - side;
    return absl::StrFormat(
        "<path class=\"%s\" d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fZ\"><title>%s%s</title></path>",
        chosen ? "point" : "line", at.x(), at.y(), a.x(), a.y(), b.x(), b.y(), NameHtml(camera.id),
        chosen ? ", chosen" : "");
  }

  const RigPlanResult& plan_;
  const Plane plane_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high_ = -low_;
};

std::string Head(const RigPlanResult& plan) {
  const PlanStep& step = plan.steps[plan.rig.cameras.size() - 1];
  return absl::StrCat("<header>\n<p class=\"kind\">Weft rig plan</p>\n<h1>",
                      Counted(static_cast<int64_t>(plan.rig.cameras.size()), "camera", "cameras"), " of ",
                      plan.candidates.cameras.size(), " cover ", FormatPercent(step.coverage),
                      " of the cells.</h1>\n<p>A cell is covered when ", plan.options.views_needed,
                      " cameras see it: nothing before it, facing within ",
                      FormatNumber(plan.options.viewing.max_facing_deg, 0), " degrees, ",
                      FormatNumber(plan.options.viewing.min_pitch_px, 1),
                      " px or more. All candidates together cover ",
                      FormatPercent(plan.steps.back().coverage), ". Looked at ",
                      Counted(static_cast<int64_t>(plan.moments.size()), "moment", "moments"),
                      " of the motion; sigma is what pixel noise of ", FormatNumber(plan.options.noise_px, 2),
                      " px leaves.</p>\n</header>\n");
}

std::string Curves(const RigPlanResult& plan) {
  PlotFrames axis;
  axis.noun = "camera";
  std::vector<double> coverage, views, sigma_mm;
  for (size_t i = 0; i < plan.steps.size(); ++i) {
    axis.names.push_back(absl::StrCat(i + 1));
    axis.without_mesh.push_back(false);
    coverage.push_back(plan.steps[i].coverage);
    views.push_back(plan.steps[i].mean_views);
    sigma_mm.push_back(plan.steps[i].median_sigma_mm);
  }
  return Section(
      "curves", "By the number of cameras",
      absl::StrCat(
          "<div class=\"plots\">\n", LinePlot(axis, coverage, {.title = "Covered cells", .unit = "%"}),
          LinePlot(axis, views, {.title = "Views of a cell, mean", .decimals = 1}),
          LinePlot(axis, sigma_mm,
                   {.title = "Expected sigma of covered cells, median, mm", .unit = "mm", .decimals = 3}),
          "</div>\n"));
}

std::string Maps(const RigPlanResult& plan) {
  std::string body;
  const RigForecast& forecast = plan.forecast;
  for (const GarmentMap& map :
       {GarmentMap{"Share of the moments in which enough cameras see the cell",
                   "share",
                   "",
                   forecast.coverage,
                   {0, 1}},
        GarmentMap{"Views", "views", "", forecast.views, RoundRange(forecast.views)},
        GarmentMap{"Pitch of the cell in the views that see it", "pitch", "px", forecast.pitch_px,
                   RoundRange(forecast.pitch_px)},
        GarmentMap{"Expected sigma", "sigma", "mm", forecast.sigma_mm, RoundRange(forecast.sigma_mm)}}) {
    const absl::StatusOr<std::string> html = GarmentMapHtml(plan.garment.rest, map);
    absl::StrAppend(
        &body,
        html.ok() ? *html : absl::StrCat("<p>", EscapeHtml(std::string(html.status().message())), "</p>"));
  }
  return Section("maps", "What the chosen cameras see",
                 absl::StrCat("<div class=\"meshes\">\n", body, "</div>\n"));
}

std::string Cameras(const RigPlanResult& plan) {
  std::string rows;
  for (size_t i = 0; i < plan.steps.size(); ++i) {
    const PlanStep& step = plan.steps[i];
    const double before = i > 0 ? plan.steps[i - 1].coverage : 0;
    rows += TableRow("td", {NameHtml(plan.candidates.cameras[step.camera].id),
                            absl::StrCat(i + 1, i < plan.rig.cameras.size() ? " (chosen)" : ""),
                            FormatPercent(step.coverage), FormatNumber(100 * (step.coverage - before), 2),
                            FormatNumber(step.mean_views, 1), FormatNumber(step.median_sigma_mm, 3)});
  }
  return Section(
      "cameras", "Cameras in the order of the choice",
      Table({"Camera", "Place", "Covered", "Added, %", "Mean views", "Sigma, mm"}, rows, "cameras"));
}

}  // namespace

std::string MakeRigPlanReport(const RigPlanResult& plan) {
  const std::string drawings =
      absl::StrCat("<div class=\"plots\">\n",
                   RigDrawing(plan, {"From above (x to the right, z down the page)", 0, 2}).Svg(),
                   RigDrawing(plan, {"From the side (z to the right, y down)", 2, 1}).Svg(),
                   "</div>\n<p>Chosen cameras are filled, the others outlined; each wedge opens to where its "
                   "camera looks. Dots are "
                   "the garment.</p>\n");
  return Page("Weft rig plan", absl::StrCat(Head(plan), Curves(plan), Section("rig", "The rig", drawings),
                                            Maps(plan), Cameras(plan)));
}

}  // namespace weft
