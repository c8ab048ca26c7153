#include "services/work/pipeline/stage_reports.h"

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "alignment/alignment_memory.h"
#include "base/median.h"
#include "triangulation/cloud_scale.h"

namespace weft {
namespace {

void AddReasons(const std::map<std::string, int>& counts,
                google::protobuf::RepeatedPtrField<v1::ReasonCount>* reasons) {
  for (const auto& [reason, count] : counts) {
    v1::ReasonCount& entry = *reasons->Add();
    entry.set_reason(reason);
    entry.set_count(count);
  }
}

v1::GarmentReport CountVertices(const RegisteredMesh& mesh, const Template& garment,
                                const GarmentSpan& counted) {
  v1::GarmentReport report;
  report.set_id(counted.id);
  report.set_vertices(counted.vertices);
  std::vector<double> sigmas;
  for (int v = counted.first_vertex; v < counted.first_vertex + counted.vertices; ++v) {
    report.set_vertices_with_cell(report.vertices_with_cell() + (garment.node_of_vertex[v].row >= 0));
    if (mesh.state[v] == VertexState::kObserved) sigmas.push_back(mesh.sigma_mm[v]);
    report.set_two_view(report.two_view() + (mesh.state[v] == VertexState::kTwoView));
  }
  report.set_observed(static_cast<int>(sigmas.size()));
  if (report.vertices_with_cell() > 0)
    report.set_coverage(static_cast<double>(report.observed()) / report.vertices_with_cell());
  report.set_median_observed_sigma_mm(Median(std::move(sigmas)));
  return report;
}

}  // namespace

void DescribeDecoding(const DecodeResult& result, v1::ViewReport& report) {
  for (const Observation& observation : result.observations) {
    if (observation.node.kind == NodeKind::kCenter) {
      report.set_centers(report.centers() + 1);
    } else {
      report.set_corners(report.corners() + 1);
    }
  }
  std::map<std::string, int> rejected;
  for (const PatchReport& patch : result.patches) {
    if (patch.accepted) {
      report.set_patches_accepted(report.patches_accepted() + 1);
    } else {
      ++rejected[patch.reason];
    }
  }
  AddReasons(rejected, report.mutable_patches_rejected());
  report.set_grey_levels(result.grey_levels);
  report.set_lattice_ms(result.timings.lattice_ms);
  report.set_colors_ms(result.timings.colors_ms);
  report.set_growth_ms(result.timings.growth_ms);
  report.set_refinement_ms(result.timings.refinement_ms);
}

void DescribeCloud(const Cloud& cloud, v1::CloudReport& report) {
  std::vector<double> views, sigmas;
  for (const CloudPoint& point : cloud.points) {
    const bool center = point.node.kind == NodeKind::kCenter;
    report.set_centers(report.centers() + center);
    report.set_corners(report.corners() + !center);
    views.push_back(point.views);
    sigmas.push_back(point.sigma_mm);
  }
  std::map<std::string, int> rejected;
  for (const RejectedNode& node : cloud.rejected) ++rejected[std::string(RejectReasonName(node.reason))];
  AddReasons(rejected, report.mutable_rejected());
  report.set_median_views(Median(std::move(views)));
  report.set_median_sigma_mm(Median(std::move(sigmas)));
}

void DescribeBias(const CameraBias& bias, v1::ViewReport& report) {
  if (bias.observations == 0) return;
  v1::CameraBias& out = *report.mutable_bias();
  out.set_observations(bias.observations);
  out.set_mean_x_px(bias.mean_px.x());
  out.set_mean_y_px(bias.mean_px.y());
  out.set_rms_px(bias.rms_px);
  out.set_significance(bias.significance);
}

namespace {

// Of the board's rows, or of its part's; 0 where unknown or where the parts differ.
double CellMm(const Board& board, const BoardNode& a, const BoardNode& b) {
  if (board.parts.empty()) return board.cell_mm;
  const int part = board.PartAt(a.row);
  return part >= 0 && part == board.PartAt(b.row) ? board.parts[part].cell_mm : 0;
}

}  // namespace

void DescribeScale(const Cloud& cloud, const Board& board, const Template& garment, v1::CloudReport& report) {
  const auto of_print = [&](const BoardNode& a, const BoardNode& b) -> std::optional<double> {
    const double cell_mm = CellMm(board, a, b);
    return cell_mm > 0 ? std::optional<double>(cell_mm) : std::nullopt;
  };
  if (const auto scale = MeasureCloudScale(cloud, of_print)) report.set_print_scale(*scale);
  std::vector<int> vertex_at(static_cast<size_t>(board.rows) * board.cols, -1);
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v) {
    const VertexNode& node = garment.node_of_vertex[v];
    if (node.IsCell() && board.Contains(node.row, node.col))
      vertex_at[static_cast<size_t>(node.row) * board.cols + node.col] = static_cast<int>(v);
  }
  const auto vertex_of = [&](const BoardNode& node) {
    return board.Contains(node.row, node.col)
               ? vertex_at[static_cast<size_t>(node.row) * board.cols + node.col]
               : -1;
  };
  const auto of_template = [&](const BoardNode& a, const BoardNode& b) -> std::optional<double> {
    const int from = vertex_of(a), to = vertex_of(b);
    if (from < 0 || to < 0) return std::nullopt;
    return (garment.rest.vertices_mm[to] - garment.rest.vertices_mm[from]).norm();
  };
  if (const auto scale = MeasureCloudScale(cloud, of_template)) report.set_template_scale(*scale);
}

void DescribeMesh(const RegisteredMesh& mesh, const Template& garment, v1::MeshReport& report) {
  const int vertices = static_cast<int>(garment.node_of_vertex.size());
  const v1::GarmentReport all = CountVertices(mesh, garment, {.vertices = vertices});
  report.set_vertices(all.vertices());
  report.set_vertices_with_cell(all.vertices_with_cell());
  report.set_observed(all.observed());
  report.set_two_view(all.two_view());
  report.set_coverage(all.coverage());
  report.set_median_observed_sigma_mm(all.median_observed_sigma_mm());
  for (const GarmentSpan& one : garment.garments) *report.add_garments() = CountVertices(mesh, garment, one);
}

void DescribeAlignment(const AlignResult& result, const Template& garment, int unclaimed,
                       v1::MeshReport& report) {
  DescribeMesh(result.mesh, garment, report);
  const size_t bytes = AlignmentMemoryBytes(report.vertices());
  report.set_alignment_memory_mib(static_cast<double>(bytes) / (1 << 20));
  report.set_self_intersections_before(result.untangling.pairs_before);
  report.set_self_intersections(result.untangling.pairs_after);
  report.set_demoted(result.untangling.demoted_vertices);
  report.set_unclaimed_points(unclaimed);
  report.set_rays(result.rays);
  for (const GarmentPair& pair : result.layers) {
    v1::GarmentOverlap& overlap = *report.add_overlaps();
    overlap.set_inner(garment.garments[pair.inner].id);
    overlap.set_outer(garment.garments[pair.outer].id);
  }
  for (const StageReport& stage : result.stages) {
    v1::AlignmentStage& entry = *report.add_stages();
    entry.set_name(stage.name);
    entry.set_iterations(stage.iterations);
    entry.set_energy_before(stage.energy_before);
    entry.set_energy_after(stage.energy_after);
    entry.set_time_ms(stage.time_ms);
  }
}

void DescribePlace(const MapPlace& place, v1::MapPlaceReport& report) {
  report.set_half_turn(place.half_turn);
  report.set_rows(place.rows);
  report.set_cols(place.cols);
  report.set_cells(place.cells);
  report.set_outside(place.outside);
  report.set_outside_there(place.outside_there);
}

void DescribeScan(const ScanFile& file, const ScanUse& use, v1::ScanReport& report) {
  report.set_points(file.points);
  report.set_unmeasured(file.unmeasured);
  report.set_without_normal(file.without_normal);
  report.set_found(use.found);
  report.set_vertices(use.vertices);
  report.set_normals_turned(use.is_turned);
  report.set_median_distance_mm(use.median_distance_mm);
}

std::string ScanText(const v1::ScanReport& report) {
  std::string text = absl::StrFormat(
      "%d points, %d of them found a vertex, %.2f mm from the cloth in the median; %d hidden vertices follow "
      "it",
      report.points(), report.found(), report.median_distance_mm(), report.vertices());
  if (report.unmeasured() > 0)
    absl::StrAppend(&text, "; ", report.unmeasured(), " points without a measurement");
  if (report.without_normal() > 0)
    absl::StrAppend(&text, "; ", report.without_normal(), " points without a normal");
  if (report.normals_turned()) absl::StrAppend(&text, "; its normals pointed inwards and were turned");
  return text;
}

}  // namespace weft
