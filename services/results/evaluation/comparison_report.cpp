#include "services/results/evaluation/comparison_report.h"

#include <filesystem>
#include <optional>

#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/results/evaluation/comparison_sequence.h"
#include "services/results/evaluation/comparison_text.h"
#include "services/results/evaluation/evaluation_text.h"
#include "services/results/evaluation/garment_maps.h"
#include "services/results/report/page.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

v1::ComparisonPage ShownComparison(const JobComparison& comparison) {
  v1::ComparisonPage page;
  page.set_headline(ComparisonHeadline(comparison));
  for (const ComparedMeasure& compared : comparison.measures) page.add_decimals(compared.measure->decimals);
  for (const ComparisonPlot& plot : ComparisonPlots(comparison)) {
    v1::ComparisonPage::Plot& shown = *page.add_plots();
    shown.set_title(plot.text.title);
    shown.set_unit(plot.text.unit);
    shown.set_decimals(plot.text.decimals);
    shown.set_from_zero(plot.text.from_zero);
    shown.set_whole_percent(plot.text.whole_percent);
    shown.set_first_style(static_cast<int>(plot.text.first_style));
    for (const PlotSeries& series : plot.series) {
      v1::ComparisonPage::Plot::Series& line = *shown.add_series();
      line.set_name(series.name);
      line.mutable_values()->Assign(series.values.begin(), series.values.end());
    }
  }
  const std::vector<bool> without_mesh = ComparisonFrames(comparison).without_mesh;
  page.mutable_without_mesh()->Assign(without_mesh.begin(), without_mesh.end());
  for (const CameraErrors& camera : comparison.a.cameras) *page.add_a_cameras() = CameraScoreMessage(camera);
  for (const CameraErrors& camera : comparison.b.cameras) *page.add_b_cameras() = CameraScoreMessage(camera);
  return page;
}

}  // namespace

std::string MakeComparisonReport(const JobComparison& comparison, const v1::PageSequence* meshes,
                                 const std::vector<std::string>& notes) {
  const v1::Comparison message = ComparisonMessage(comparison);
  v1::ComparisonPage shown = ShownComparison(comparison);
  *shown.mutable_notes() = {notes.begin(), notes.end()};
  v1::PageMaps maps;
  for (const auto& [name, map] : ComparisonMaps(comparison)) AddGarmentMap(comparison.a.shape, map, maps);
  return MakePage(
      {.title = "Weft comparison",
       .kind = "comparison",
       .data = {{"comparison", &message}, {"page", &shown}, {"maps", &maps}, {"meshes", meshes}}});
}

absl::Status WriteComparison(const std::string& folder, const JobComparison& comparison) {
  WEFT_ASSIGN_OR_RETURN(const std::string json, ToJson(ComparisonMessage(comparison)));
  absl::Status status = CreateFolders(folder);
  const auto write = [&](const fs::path& name, const std::string& text) {
    if (text.empty() || !status.ok()) return;
    if (name.has_parent_path()) status = CreateFolders((fs::path(folder) / name.parent_path()).string());
    if (status.ok()) status = WriteFileAtomically((fs::path(folder) / name).string(), text);
  };
  write("measures.csv", ComparisonCsv(comparison));
  write("frames.csv", ComparedFrameCsv(comparison));
  write("cameras.csv", ComparedCameraCsv(comparison));
  write("vertices.csv", ComparedVertexCsv(comparison));
  const PlotFrames axis = ComparisonFrames(comparison);
  for (const ComparisonPlot& plot : ComparisonPlots(comparison))
    write(fs::path("plots") / (plot.name + ".svg"), OverlaidPlotSvg(axis, plot.series, plot.text));
  for (const auto& [name, map] : ComparisonMaps(comparison)) {
    if (comparison.a.shape.vertices_mm.empty()) break;
    const absl::StatusOr<std::string> svg = GarmentMapSvg(comparison.a.shape, map);
    if (svg.ok()) write(fs::path("maps") / (name + ".svg"), *svg);
  }
  write("comparison.json", json);
  std::vector<std::string> notes;
  const std::optional<v1::PageSequence> meshes = ComparisonSequence(comparison, notes);
  write("report.html", MakeComparisonReport(comparison, meshes ? &*meshes : nullptr, notes));
  return status;
}

}  // namespace weft
