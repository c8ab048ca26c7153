#include "services/tools/cli/template_summary.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "alignment/template_build/mesh_topology.h"
#include "base/status_macros.h"
#include "services/formats/verdict/verdict.h"
#include "services/results/report/html_text.h"

namespace weft {
namespace {

using Edge = std::pair<int, int>;

std::vector<Edge> EdgesOf(const std::vector<Face>& faces, size_t count) {
  std::vector<Edge> edges;
  edges.reserve(3 * count);
  for (size_t f = 0; f < count; ++f) {
    for (int i = 0; i < 3; ++i) edges.push_back(std::minmax(faces[f][i], faces[f][(i + 1) % 3]));
  }
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

// What template.json says of seams and openings against the mesh.
absl::Status CheckPartsInMesh(const Template& garment, const GarmentParts& parts,
                              const MeshTopology& topology) {
  const std::vector<Edge> edges = EdgesOf(garment.rest.faces, garment.rest.faces.size());
  for (size_t i = 0; i < parts.seams.size(); ++i) {
    const Seam& seam = parts.seams[i];
    for (const std::vector<int>* side : {&seam.side_a, &seam.side_b}) {
      for (size_t k = 1; k < side->size(); ++k) {
        if (std::ranges::binary_search(edges, Edge(std::minmax((*side)[k - 1], (*side)[k])))) continue;
        return absl::FailedPreconditionError(absl::StrCat("seam ", i, " runs from vertex ", (*side)[k - 1],
                                                          " to ", (*side)[k],
                                                          ", where the mesh has no edge"));
      }
    }
  }
  std::set<std::vector<int>> borders;
  for (std::vector<int> loop : topology.loops) {
    std::ranges::sort(loop);
    borders.insert(std::move(loop));
  }
  for (size_t i = 0; i < parts.openings.size(); ++i) {
    std::vector<int> loop = parts.openings[i].loop;
    std::ranges::sort(loop);
    if (!borders.contains(loop)) {
      return absl::FailedPreconditionError(
          absl::StrCat("opening ", i, " of template.json is no border of the mesh"));
    }
  }
  return absl::OkStatus();
}

void AddStrain(const Template& garment, const GarmentParts& parts, v1::TemplateSummary* summary) {
  std::vector<double> strain;
  for (const auto& [a, b] : EdgesOf(garment.rest.faces, parts.panel_faces)) {
    const double print_mm = (parts.texture_mm[b] - parts.texture_mm[a]).norm();
    const double rest_mm = (garment.rest.vertices_mm[b] - garment.rest.vertices_mm[a]).norm();
    if (print_mm > 0) strain.push_back(std::abs(rest_mm / print_mm - 1));
  }
  if (strain.empty()) return;
  std::ranges::sort(strain);
  summary->set_strain_median(strain[strain.size() / 2]);
  summary->set_strain_p95(strain[strain.size() * 95 / 100]);
}

std::string OpeningsText(const v1::TemplateSummary& summary) {
  std::vector<std::string> lengths;
  for (const double length_mm : summary.openings_mm()) {
    lengths.push_back(absl::StrFormat("%.0f mm", length_mm));
  }
  return lengths.empty() ? "none" : absl::StrJoin(lengths, ", ");
}

}  // namespace

absl::StatusOr<v1::TemplateSummary> SummarizeTemplate(const Template& garment, const GarmentParts& parts) {
  const int vertices = static_cast<int>(garment.rest.vertices_mm.size());
  WEFT_ASSIGN_OR_RETURN(const MeshTopology topology, CheckTopology(vertices, garment.rest.faces));
  WEFT_RETURN_IF_ERROR(CheckPartsInMesh(garment, parts, topology));
  v1::TemplateSummary summary;
  summary.set_id(garment.id);
  summary.set_hash(garment.ContentHash());
  summary.set_board_hash(garment.board_hash);
  summary.set_vertices(vertices);
  const auto count = [&](bool (VertexNode::*is)() const) {
    return static_cast<int>(std::ranges::count_if(garment.node_of_vertex, std::mem_fn(is)));
  };
  summary.set_vertices_with_cell(count(&VertexNode::IsCell));
  summary.set_vertices_with_corner(count(&VertexNode::IsCorner));
  summary.set_faces(static_cast<int>(garment.rest.faces.size()));
  summary.set_components(topology.components);
  summary.set_euler(topology.euler);
  summary.set_handles(topology.genus);
  for (const std::vector<int>& loop : topology.loops) {
    summary.add_openings_mm(LoopLengthMm(loop, garment.rest.vertices_mm));
  }
  std::ranges::sort(*summary.mutable_openings_mm(), std::greater<>());
  if (parts.expected_openings >= 0) summary.set_expected_openings(parts.expected_openings);
  summary.set_panels(static_cast<int>(parts.panels.size()));
  summary.set_seams(static_cast<int>(parts.seams.size()));
  if (!parts.texture_mm.empty()) {
    double cells = 0;
    for (const TemplatePanel& panel : parts.panels) cells += panel.cells;
    summary.set_texture_coverage(cells * std::pow(parts.cell_mm / parts.texture_side_mm, 2));
    AddStrain(garment, parts, &summary);
  }
  return summary;
}

void AddPrintScale(const TemplateSize& size, v1::TemplateSummary* summary) {
  const auto off = [](const PrintScale& scale) { return std::abs(scale.Worst() - 1); };
  const PrintScale* worst = nullptr;
  for (const PrintScale& scale : size.scales)
    if (scale.median > 0 && (worst == nullptr || off(scale) > off(*worst))) worst = &scale;
  if (worst == nullptr) return;
  summary->set_print_scale(worst->median);
  if (worst->along_axis > 0) summary->set_print_scale_along_axis(worst->along_axis);
}

absl::Status CheckOpeningCount(const v1::TemplateSummary& summary, int expected) {
  if (expected < 0 || summary.openings_mm_size() == expected) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("the garment has ", summary.openings_mm_size(),
                                                    " openings, expected were ", expected,
                                                    ". Lengths of their borders: ", OpeningsText(summary)));
}

std::string TemplateHeadline(const v1::TemplateSummary& summary) {
  const auto counted = [](int count, const char* one, const char* many) { return Counted(count, one, many); };
  std::string parts;
  if (summary.panels() > 0)
    parts = absl::StrCat(counted(summary.panels(), "panel", "panels"), ", ",
                         counted(summary.seams(), "seam", "seams"), ", ");
  return absl::StrCat(parts, counted(summary.openings_mm_size(), "opening", "openings"), ", ",
                      counted(summary.vertices(), "vertex", "vertices"));
}

v1::Verdict TemplateVerdict(const v1::TemplateSummary& summary) {
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_GOOD, TemplateHeadline(summary), "");
  for (const std::string& warning : summary.warnings())
    AddFinding(verdict, v1::GRADE_USABLE, warning,
               "Look at the report; where it is not as sewn, build again from more frames.");
  if (summary.components() > 1)
    AddFinding(verdict, v1::GRADE_USABLE,
               absl::StrCat("the garment is in ", summary.components(), " disconnected pieces"),
               "Check that no seam was missed: --max-seam-gap-mm limits the distance of its sides.");
  if (summary.handles() > 0)
    AddFinding(verdict, v1::GRADE_USABLE,
               absl::StrCat("the surface has ", Counted(summary.handles(), "handle", "handles"),
                            ": cloth that is sewn to cloth it does not touch"),
               "Look at the seams in the report; a pocket or a strap may be one, a sleeve is not.");
  if (summary.has_print_scale()) {
    const PrintScale scale{summary.print_scale(), {}, summary.print_scale_along_axis()};
    AddCheck(verdict, kTemplateScale, 100 * std::abs(scale.Worst() - 1));
  }
  if (summary.has_strain_p95()) AddCheck(verdict, kTemplateStrain, 100 * summary.strain_p95());
  return verdict;
}

std::string TemplateSummaryText(const v1::TemplateSummary& summary) {
  const std::string corners =
      summary.vertices_with_corner() > 0
          ? absl::StrCat(FormatCount(summary.vertices_with_corner()), " on a corner, ")
          : "";
  std::string text = absl::StrCat(
      summary.id(), ": ", FormatCount(summary.vertices()), " vertices, ", FormatCount(summary.faces()),
      " faces, ", FormatCount(summary.vertices_with_cell()), " vertices with a cell, ", corners, "hash ",
      summary.hash(), "\nsurface  clean, ", Counted(summary.components(), "piece", "pieces"),
      ", Euler characteristic ", summary.euler(), ", ", Counted(summary.handles(), "handle", "handles"),
      "\nopenings ", summary.openings_mm_size(), ": ", OpeningsText(summary), "\n");
  if (summary.panels() > 0)
    absl::StrAppend(&text, "parts    ", Counted(summary.panels(), "panel", "panels"), ", ",
                    Counted(summary.seams(), "seam", "seams"), "\n");
  if (summary.texture_coverage() > 0)
    absl::StrAppendFormat(&text, "texture  panels cover %.0f %% of its square\n",
                          100 * summary.texture_coverage());
  if (summary.has_print_scale())
    absl::StrAppendFormat(&text, "size     edges are %.4f times as long as on the print in the median\n",
                          summary.print_scale());
  if (summary.has_print_scale_along_axis())
    absl::StrAppendFormat(&text, "         %.4f times along the direction that is furthest off\n",
                          summary.print_scale_along_axis());
  if (summary.has_strain_median())
    absl::StrAppendFormat(&text, "rest     edges within %.1f %% of the print (median), %.1f %% (95 of 100)\n",
                          100 * summary.strain_median(), 100 * summary.strain_p95());
  return text;
}

std::string TemplateIdOf(const std::string& folder) {
  const std::filesystem::path path = std::filesystem::path(folder).lexically_normal();
  const std::string name =
      path.has_filename() ? path.filename().string() : path.parent_path().filename().string();
  return name.empty() || name == "." || name == ".." ? "template" : name;
}

}  // namespace weft
