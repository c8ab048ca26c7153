#include "services/results/report/template_report.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/parts_message.h"
#include "services/results/report/frame_pictures.h"
#include "services/results/report/garment_map.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/page.h"
#include "services/results/report/picture_data.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {
namespace {

// Hues a golden angle apart, so that neighbours in the list differ most.
Eigen::Vector3f SeamColor(size_t seam) {
  const double hue = std::fmod(0.02 + 0.618034 * static_cast<double>(seam), 1.0);
  const double lightness = seam % 3 == 1 ? 0.42 : seam % 3 == 2 ? 0.62 : 0.52;
  Eigen::Vector3f color;
  for (int i = 0; i < 3; ++i) {
    const double place = std::fmod(hue + (3 - i) / 3.0, 1.0);
    const double ramp = std::clamp(std::abs(6 * place - 3) - 1, 0.0, 1.0);
    color[i] = static_cast<float>(lightness + (ramp - 0.5) * 0.75 * (1 - std::abs(2 * lightness - 1)));
  }
  return color;
}

// The garment with its seams in the colours of the board's picture, openings dark.
absl::StatusOr<std::vector<MeshPicture>> SewnPictures(const BuiltTemplate& built) {
  std::vector<Eigen::Vector3f> colors = PlainColors(built.garment.rest.vertices_mm.size());
  for (size_t i = 0; i < built.parts.seams.size(); ++i) {
    const Seam& seam = built.parts.seams[i];
    for (const std::vector<int>* row : {&seam.side_a, &seam.middle, &seam.side_b}) {
      for (const int v : *row) colors[v] = SeamColor(i);
    }
  }
  for (const TemplateBorder& opening : built.parts.openings) {
    for (const int v : opening.loop) colors[v] = Eigen::Vector3f::Constant(0.15F);
  }
  return DrawBothSides(built.garment.rest, colors, 0.7);
}

v1::TemplatePage::Outline OutlineOf(const BuiltTemplate& built, const std::vector<int>& vertices) {
  v1::TemplatePage::Outline outline;
  for (const int v : vertices) {
    const VertexNode& cell = built.sheet.cell_of_vertex[v];
    outline.add_cells(cell.col);
    outline.add_cells(cell.row);
    for (const double mm : built.parts.texture_mm[v]) outline.add_texture_mm(static_cast<float>(mm));
  }
  return outline;
}

absl::StatusOr<v1::PageMap> StrainMap(const BuiltTemplate& built) {
  GarmentMap strain{"Distance from the print", "strain", "%", built.strain.of_vertex, {}};
  for (double& value : strain.values) value *= 100;
  strain.range = RoundRange(strain.values);
  return GarmentMapData(built.garment.rest, strain);
}

absl::StatusOr<v1::TemplatePage> PageOf(const BuiltTemplate& built, const TemplateReportInputs& inputs) {
  v1::TemplatePage page;
  WEFT_ASSIGN_OR_RETURN(const std::vector<MeshPicture> sewn, SewnPictures(built));
  WEFT_ASSIGN_OR_RETURN(*page.mutable_strain(), StrainMap(built));
  AddPictures(sewn, *page.mutable_sewn());
  page.set_seam_faces(built.seam_faces);
  for (const std::vector<int>& loop : built.sheet.loops) *page.add_outlines() = OutlineOf(built, loop);
  for (size_t i = 0; i < built.parts.seams.size(); ++i) {
    v1::TemplatePage::Seam& seam = *page.add_seams();
    seam.set_color(HexColor(SeamColor(i)));
    *seam.mutable_side_a() = OutlineOf(built, built.parts.seams[i].side_a);
    *seam.mutable_side_b() = OutlineOf(built, built.parts.seams[i].side_b);
  }
  GarmentParts closed;
  closed.openings = built.closed_holes;
  v1::Template holes;
  AddParts(closed, holes);
  *page.mutable_closed_holes() = holes.openings();
  page.set_measured_pitch_mm(built.measured_pitch_mm);
  page.set_filled_cells(built.filled_cells);
  page.set_contradicting_points(built.contradicting_points);
  page.set_speck_cells(built.speck_cells);
  page.set_board(inputs.board);
  page.set_panels(inputs.panels);
  *page.mutable_clouds() = {inputs.clouds.begin(), inputs.clouds.end()};
  page.set_reference(built.reference);
  return page;
}

}  // namespace

absl::StatusOr<std::string> MakeTemplateReport(const BuiltTemplate& built, const v1::TemplateSummary& summary,
                                               const TemplateReportInputs& inputs) {
  WEFT_ASSIGN_OR_RETURN(const v1::TemplatePage page, PageOf(built, inputs));
  v1::Template parts;
  AddParts(built.parts, parts);
  return MakePage({.title = absl::StrCat("Template ", built.garment.id),
                   .kind = "template",
                   .data = {{"summary", &summary}, {"template", &parts}, {"page", &page}}});
}

}  // namespace weft
