// The page of a rig plan.
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/evaluation/plan_rig.h"
#include "services/results/report/html_text.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/picture_html.h"
#include "services/results/report/plot.h"
#include "services/results/report/report_sections.h"
#include "services/results/report/rig_drawing.h"
#include "services/results/report/verdict_html.h"

namespace weft {
namespace {

// Names of candidates that were not chosen only where there are few.
constexpr size_t kMostNamed = 60;

std::string Drawing(const RigPlanResult& plan, const PaperAxes& axes) {
  RigDrawing drawing(axes);
  for (const CameraModel& camera : plan.candidates.cameras) drawing.Hold(camera.CenterWorld());
  const std::vector<Eigen::Vector3d>& vertices = plan.garment.rest.vertices_mm;
  for (const Eigen::Vector3d& v : vertices) drawing.Hold(v);
  const size_t step = std::max<size_t>(1, vertices.size() / 1500);
  for (size_t v = 0; v < vertices.size(); v += step) {
    const Eigen::Vector2d at = drawing.Place(vertices[v]);
    drawing.Add(
        absl::StrFormat("<circle class=\"range\" cx=\"%.1f\" cy=\"%.1f\" r=\"1.2\"/>", at.x(), at.y()));
  }
  for (const CameraModel& camera : plan.rig.cameras) drawing.AddCamera(camera, "point", ", chosen", true);
  const bool are_few = plan.candidates.cameras.size() <= kMostNamed;
  for (const CameraModel& camera : plan.candidates.cameras)
    if (plan.rig.IndexOf(camera.id) < 0) drawing.AddCamera(camera, "line", "", are_few);
  return drawing.Figure();
}

std::string Head(const RigPlanResult& plan) {
  return PageHead(
      "Weft rig plan", RigPlanHeadline(plan) + ".", RigPlanVerdict(plan),
      absl::StrCat("<p>A cell is covered when ", plan.options.views_needed,
                   " cameras see it: nothing before it, facing within ",
                   FormatNumber(plan.options.viewing.max_facing_deg, 0), " degrees, ",
                   FormatNumber(plan.options.viewing.min_pitch_px, 1),
                   " px or more. All candidates together cover ", FormatPercent(plan.steps.back().coverage),
                   ". Evaluated ", Counted(static_cast<int64_t>(plan.moments.size()), "moment", "moments"),
                   " of the motion; sigma is what pixel noise of ", FormatNumber(plan.options.noise_px, 2),
                   " px leaves.</p>\n"));
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
       {ShareMap("Share of the moments in which enough cameras see the cell", "share", forecast.coverage),
        GarmentMap{"Views of a cell, mean", "views", "", forecast.views, RoundRange(forecast.views)},
        GarmentMap{"Pitch of the cell in the views that see it", "pitch", "px", forecast.pitch_px,
                   RoundRange(forecast.pitch_px)},
        GarmentMap{"Expected sigma", "sigma", "mm", forecast.sigma_mm, RoundRange(forecast.sigma_mm)}}) {
    const absl::StatusOr<std::string> html = GarmentMapHtml(plan.garment.rest, map);
    absl::StrAppend(
        &body,
        html.ok() ? *html : absl::StrCat("<p>", EscapeHtml(std::string(html.status().message())), "</p>"));
  }
  return Section("maps", "Coverage of the selected cameras",
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
  return Section("cameras", "Cameras in order of selection",
                 Table({"Camera", "Place", "Covered", "Added, %", "Views of a cell, mean", "Sigma, mm"}, rows,
                       "cameras"));
}

}  // namespace

std::string MakeRigPlanReport(const RigPlanResult& plan) {
  const std::string drawings = absl::StrCat("<div class=\"plots drawings\">\n", Drawing(plan, FromAbove()),
                                            Drawing(plan, FromTheSide()),
                                            "</div>\n<p>Selected cameras are filled, the others outlined; "
                                            "each wedge opens in the direction that its "
                                            "camera faces. Dots are "
                                            "the garment.</p>\n");
  return Page("Weft rig plan", absl::StrCat(Head(plan), Curves(plan), Section("rig", "The rig", drawings),
                                            Maps(plan), Cameras(plan)));
}

}  // namespace weft
