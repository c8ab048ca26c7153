// The page of a rig plan.
#include <algorithm>

#include "services/results/evaluation/garment_maps.h"
#include "services/results/evaluation/plan_rig.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/page.h"

namespace weft {
namespace {

constexpr size_t kMostDots = 1500;

v1::RigPlanPage DrawnPlan(const RigPlanResult& plan) {
  v1::RigPlanPage page;
  page.set_headline(RigPlanHeadline(plan));
  for (const CameraModel& camera : plan.candidates.cameras) {
    const Eigen::Vector3d center_mm = camera.CenterWorld(), look = camera.rotation.row(2).transpose();
    v1::RigPlanPage::Camera& drawn = *page.add_cameras();
    drawn.set_id(camera.id);
    drawn.mutable_center_mm()->Assign(center_mm.begin(), center_mm.end());
    drawn.mutable_look()->Assign(look.begin(), look.end());
  }
  const std::vector<Eigen::Vector3d>& vertices = plan.garment.rest.vertices_mm;
  const size_t step = std::max<size_t>(1, vertices.size() / kMostDots);
  for (size_t v = 0; v < vertices.size(); v += step)
    for (const double mm : vertices[v]) page.add_garment_mm(static_cast<float>(mm));
  return page;
}

v1::PageMaps ForecastMaps(const RigPlanResult& plan) {
  v1::PageMaps maps;
  const RigForecast& forecast = plan.forecast;
  for (const GarmentMap& map :
       {ShareMap("Share of the moments in which enough cameras see the cell", "share", forecast.coverage),
        GarmentMap{"Views of a cell, mean", "views", "", forecast.views, RoundRange(forecast.views)},
        GarmentMap{"Pitch of the cell in the views that see it", "pitch", "px", forecast.pitch_px,
                   RoundRange(forecast.pitch_px)},
        GarmentMap{"Expected sigma", "sigma", "mm", forecast.sigma_mm, RoundRange(forecast.sigma_mm)}})
    AddGarmentMap(plan.garment.rest, map, maps);
  return maps;
}

}  // namespace

std::string MakeRigPlanReport(const RigPlanResult& plan) {
  const v1::RigPlan message = RigPlanMessage(plan);
  const v1::RigPlanPage drawn = DrawnPlan(plan);
  const v1::PageMaps maps = ForecastMaps(plan);
  return MakePage({.title = "Weft rig plan",
                   .kind = "rig_plan",
                   .data = {{"plan", &message}, {"page", &drawn}, {"maps", &maps}}});
}

}  // namespace weft
