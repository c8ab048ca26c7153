// Plots and maps of a comparison.
#include <algorithm>
#include <cmath>
#include <limits>

#include "services/formats/files/frame_paths.h"
#include "services/results/evaluation/comparison_report.h"
#include "services/results/report/mesh_colors.h"

namespace weft {
namespace {

constexpr double kNotThere = std::numeric_limits<double>::quiet_NaN();

bool LacksMesh(const EvaluatedFrame& frame) {
  return std::ranges::find(frame.missing, FileName(FrameFile::kMesh)) != frame.missing.end();
}

// An axis that begins at zero would squeeze differences that are small beside the values.
bool BeginsAtZero(const std::vector<PlotSeries>& series) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const PlotSeries& one : series)
    for (const double value : one.values)
      if (std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
  return low < 0.5 * high;
}

std::vector<double> PerCent(std::vector<double> shares) {
  for (double& share : shares) share *= 100;
  return shares;
}

}  // namespace

PlotFrames ComparisonFrames(const JobComparison& comparison) {
  PlotFrames axis;
  for (size_t f = 0; f < comparison.a.frames.size(); ++f) {
    axis.names.push_back(comparison.a.frames[f].frame);
    axis.without_mesh.push_back(LacksMesh(comparison.a.frames[f]) || LacksMesh(comparison.b.frames[f]));
  }
  return axis;
}

std::vector<ComparisonPlot> ComparisonPlots(const JobComparison& comparison) {
  std::vector<ComparisonPlot> plots;
  if (comparison.a.frames.size() < 2) return plots;
  for (const ComparedMeasure& compared : comparison.measures) {
    const EvaluationMeasure& measure = *compared.measure;
    PlotText text{.title = TitleWithUnit(measure), .unit = measure.unit, .decimals = measure.decimals};
    std::vector<PlotSeries> series = {{"A", {}}, {"B", {}}};
    for (size_t f = 0; f < comparison.a.frames.size(); ++f) {
      series[0].values.push_back(measure.value(comparison.a.frames[f]).value_or(kNotThere));
      series[1].values.push_back(measure.value(comparison.b.frames[f]).value_or(kNotThere));
    }
    text.from_zero = BeginsAtZero(series), text.whole_percent = false;
    plots.push_back({measure.name, text, std::move(series)});
  }
  if (!comparison.total.distance_mm) return plots;
  std::vector<PlotSeries> distance = {{"mean", {}}, {"95 %", {}}};
  for (const FrameDifference& frame : comparison.frames) {
    distance[0].values.push_back(frame.distance_mm ? frame.distance_mm->mean : kNotThere);
    distance[1].values.push_back(frame.distance_mm ? frame.distance_mm->p95 : kNotThere);
  }
  // Other looks than those of A and B.
  const Measure& apart = MeasureNamed("distance_mm");
  plots.push_back(
      {apart.name,
       {.title = TitleWithUnit(apart), .unit = apart.unit, .decimals = apart.decimals, .first_style = 2},
       std::move(distance)});
  return plots;
}

std::vector<std::pair<std::string, GarmentMap>> ComparisonMaps(const JobComparison& comparison) {
  const DifferenceMaps& maps = comparison.maps;
  const VertexMaps& a_minus_b = maps.a_minus_b;
  const char* drift_unit = comparison.a.fps > 0 ? "mm/s" : "mm a frame";
  std::vector<std::pair<std::string, GarmentMap>> out;
  const auto add = [&](const std::string& name, const std::string& title, const std::string& label,
                       const std::string& unit, const std::vector<double>& values, bool is_difference) {
    if (values.empty()) return;
    const ScalarRange range = is_difference ? RoundRangeAroundZero(values) : RoundRange(values);
    out.emplace_back(name, GarmentMap{title, label, unit, values, range});
  };
  add("distance_mm", "Distance of A and B, mean over the frames", "distance", "mm", maps.distance_mm, false);
  add("distance_sigmas", "Distance of A and B in sigmas of both, mean (beyond 3.4 is hardly noise)",
      "distance", "sigmas", maps.distance_sigmas, false);
  add("error_difference_mm", "Vertex error, A minus B (blue: A is better)", "A minus B", "mm",
      a_minus_b.error_mm, true);
  add("visibility_difference", "Visibility, A minus B (orange: A observes more)", "A minus B", "%",
      PerCent(a_minus_b.visibility), true);
  add("distortion_difference_mm", "Geodesic distortion, A minus B (blue: A is better)", "A minus B", "mm",
      a_minus_b.distortion_mm, true);
  add("texture_drift_difference", "Drift by texture flow, A minus B (blue: A is better)", "A minus B",
      drift_unit, a_minus_b.texture_drift, true);
  add("exact_drift_difference", "Exact drift, A minus B (blue: A is better)", "A minus B", drift_unit,
      a_minus_b.true_drift, true);
  return out;
}

}  // namespace weft
