#include "services/results/report/template_report.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/status_macros.h"
#include "services/results/report/frame_pictures.h"
#include "services/results/report/html_text.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/picture_html.h"
#include "services/results/report/report_sections.h"
#include "services/results/report/verdict_html.h"

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

// Vertices as a path over the board's cells.
std::string OutlinePath(const PanelSheet& sheet, const std::vector<int>& vertices, bool closed) {
  std::string path;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const VertexNode& cell = sheet.cell_of_vertex[vertices[i]];
    absl::StrAppendFormat(&path, "%c%.1f %.1f", i == 0 ? 'M' : 'L', cell.col + 0.5, cell.row + 0.5);
  }
  return closed ? path + "Z" : path;
}

std::string Label(const PanelSheet& sheet, int vertex, double size, const std::string& color,
                  const std::string& text) {
  const VertexNode& cell = sheet.cell_of_vertex[vertex];
  return absl::StrFormat(
      "<text x=\"%.1f\" y=\"%.1f\" font-size=\"%.1f\" text-anchor=\"middle\" dominant-baseline=\"central\" "
      "fill=\"%s\" stroke=\"#fff\" stroke-width=\"%.2f\" paint-order=\"stroke\" "
      "font-weight=\"bold\">%s</text>\n",
      cell.col + 0.5, cell.row + 0.5, size, color, size / 6, text);
}

std::string BoardPicture(const BuiltTemplate& built) {
  int first_row = 1 << 30, last_row = 0, first_col = 1 << 30, last_col = 0;
  for (const TemplatePanel& panel : built.parts.panels) {
    first_row = std::min(first_row, panel.first_row), last_row = std::max(last_row, panel.last_row);
    first_col = std::min(first_col, panel.first_col), last_col = std::max(last_col, panel.last_col);
  }
  const double unit = std::max(last_col - first_col, last_row - first_row) / 100.0, margin = 3 * unit;
  const PanelSheet& sheet = built.sheet;
  std::string svg = absl::StrFormat(
      "<svg viewBox=\"%.1f %.1f %.1f %.1f\" role=\"img\" aria-label=\"Panels on the board\">\n",
      first_col - margin, first_row - margin, last_col - first_col + 1 + 2 * margin,
      last_row - first_row + 1 + 2 * margin);
  std::string outlines;
  for (const std::vector<int>& loop : sheet.loops) outlines += OutlinePath(sheet, loop, true);
  absl::StrAppendFormat(&svg,
                        "<path d=\"%s\" fill=\"#c9ced6\" fill-rule=\"evenodd\" stroke=\"#7d8590\" "
                        "stroke-width=\"%.2f\"/>\n",
                        outlines, 0.3 * unit);
  std::string labels;
  for (size_t i = 0; i < built.parts.seams.size(); ++i) {
    const std::string color = HexColor(SeamColor(i));
    for (const std::vector<int>* side : {&built.parts.seams[i].side_a, &built.parts.seams[i].side_b}) {
      absl::StrAppendFormat(&svg,
                            "<path d=\"%s\" fill=\"none\" stroke=\"%s\" stroke-width=\"%.2f\" "
                            "stroke-linejoin=\"round\"/>\n",
                            OutlinePath(sheet, *side, false), color, 0.9 * unit);
      labels += Label(sheet, (*side)[side->size() / 2], 2.6 * unit, color, absl::StrCat(i + 1));
    }
  }
  for (size_t p = 0; p < built.parts.panels.size(); ++p) {
    const TemplatePanel& panel = built.parts.panels[p];
    const double width = panel.last_col - panel.first_col, height = panel.last_row - panel.first_row;
    labels += absl::StrFormat(
        "<text x=\"%.1f\" y=\"%.1f\" font-size=\"%.1f\" text-anchor=\"middle\" dominant-baseline=\"central\" "
        "fill=\"#30363d\">%d</text>\n",
        panel.first_col + width / 2, panel.first_row + height / 2,
        std::clamp(0.8 * std::min(width, height), 1.5 * unit, 6 * unit), p + 1);
  }
  return svg + labels + "</svg>\n";
}

// The panels as charts, with their cells' rows as they lie on the board.
std::string TexturePicture(const BuiltTemplate& built) {
  const GarmentParts& parts = built.parts;
  const double side = parts.texture_side_mm;
  std::string svg = absl::StrFormat(
      "<svg viewBox=\"0 0 %.1f %.1f\" role=\"img\" aria-label=\"Panels in the texture\" "
      "style=\"max-width:34em\">\n"
      "<rect width=\"%.1f\" height=\"%.1f\" fill=\"none\" stroke=\"#7d8590\" stroke-width=\"%.2f\"/>\n",
      side, side, side, side, side / 300);
  std::string outlines;
  for (const std::vector<int>& loop : built.sheet.loops) {
    for (size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector2d& place = parts.texture_mm[loop[i]];
      absl::StrAppendFormat(&outlines, "%c%.1f %.1f", i == 0 ? 'M' : 'L', place.x(), side - place.y());
    }
    outlines += "Z";
  }
  absl::StrAppendFormat(&svg,
                        "<path d=\"%s\" fill=\"#c9ced6\" fill-rule=\"evenodd\" stroke=\"#7d8590\" "
                        "stroke-width=\"%.2f\"/>\n",
                        outlines, side / 500);
  for (size_t p = 0; p < parts.panels.size(); ++p) {
    const TemplatePanel& panel = parts.panels[p];
    double rows = panel.last_row - panel.first_row + 1, cols = panel.last_col - panel.first_col + 1;
    if (panel.quarter_turns % 2 == 1) std::swap(rows, cols);
    const double x = (panel.texture_col + cols / 2) * parts.cell_mm,
                 y = (panel.texture_row + rows / 2) * parts.cell_mm;
    absl::StrAppendFormat(&svg,
                          "<text transform=\"translate(%.1f %.1f) rotate(%d)\" font-size=\"%.1f\" "
                          "text-anchor=\"middle\" dominant-baseline=\"central\" fill=\"#30363d\">%d</text>\n",
                          x, y, 90 * panel.quarter_turns, side / 20, p + 1);
  }
  return svg + "</svg>\n";
}

std::string TextureSection(const BuiltTemplate& built) {
  const GarmentParts& parts = built.parts;
  double cells = 0;
  for (const TemplatePanel& panel : parts.panels) cells += panel.cells;
  const double share = cells * std::pow(parts.cell_mm / parts.texture_side_mm, 2);
  return absl::StrCat("<p>The panels as they lie on the board, packed into a square of ",
                      FormatNumber(parts.texture_side_mm, 0), " mm a side, of which they cover ",
                      FormatPercent(share), ". Numbers are upright as on the board.</p>\n",
                      TexturePicture(built));
}

std::string Swatch(size_t seam) {
  return absl::StrCat("<span style=\"color:", HexColor(SeamColor(seam)), "\">&#9632;</span> ", seam + 1);
}

std::string Names(std::vector<int> panels) {
  for (int& panel : panels) ++panel;
  return absl::StrJoin(panels, ", ");
}

std::string SeamTable(const BuiltTemplate& built) {
  std::string rows;
  for (size_t i = 0; i < built.parts.seams.size(); ++i) {
    const Seam& seam = built.parts.seams[i];
    rows += TableRow("td", {Swatch(i), absl::StrCat(seam.panel_a + 1), absl::StrCat(seam.panel_b + 1),
                            FormatNumber(seam.length_mm, 0), FormatNumber(seam.gap_mm, 1),
                            FormatNumber(seam.max_gap_mm, 1),
                            absl::StrCat(seam.side_a.size(), " / ", seam.side_b.size())});
  }
  return Table({"Seam", "Panel", "with panel", "Length, mm", "Width, mm", "Widest, mm", "Cells"}, rows, "");
}

std::string BorderTable(const BuiltTemplate& built) {
  std::string rows;
  const auto add = [&](const char* name, const std::vector<TemplateBorder>& borders) {
    for (size_t i = 0; i < borders.size(); ++i) {
      rows += TableRow("td",
                       {absl::StrCat(name, " ", i + 1), FormatNumber(borders[i].length_mm, 0),
                        Names(borders[i].panels), FormatCount(static_cast<int64_t>(borders[i].loop.size()))});
    }
  };
  add("Opening", built.parts.openings);
  add("Closed hole", built.closed_holes);
  return Table({"Border", "Length, mm", "Along panels", "Vertices"}, rows, "");
}

std::string PanelTable(const BuiltTemplate& built) {
  std::string rows;
  for (size_t i = 0; i < built.parts.panels.size(); ++i) {
    const TemplatePanel& p = built.parts.panels[i];
    rows += TableRow(
        "td", {absl::StrCat(i + 1), FormatCount(p.cells), absl::StrCat(p.first_row, " to ", p.last_row),
               absl::StrCat(p.first_col, " to ", p.last_col)});
  }
  return Table({"Panel", "Cells", "Rows", "Columns"}, rows, "");
}

// The garment with its seams in the colours of the board's picture, openings dark.
absl::StatusOr<std::string> SewnPictures(const BuiltTemplate& built) {
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
  WEFT_ASSIGN_OR_RETURN(const std::vector<MeshPicture> pictures,
                        DrawBothSides(built.garment.rest, colors, 0.7));
  return PictureRow(pictures, "the template", "seam", "<p>Seams coloured as above, openings dark.</p>");
}

std::string HeadOf(const BuiltTemplate& built, const v1::Verdict& verdict) {
  const Template& garment = built.garment;
  const auto corners =
      std::ranges::count_if(garment.node_of_vertex, [](const VertexNode& node) { return node.IsCorner(); });
  const std::string more = absl::StrCat(
      "<p>", FormatCount(static_cast<int64_t>(garment.rest.vertices_mm.size())), " vertices, ",
      corners > 0 ? absl::StrCat(FormatCount(corners), " of them corners between cells, ") : "",
      FormatCount(static_cast<int64_t>(garment.rest.faces.size())), " faces (", FormatCount(built.seam_faces),
      " of them across seams), Euler characteristic ", FormatCount(built.euler), ", ",
      Counted(built.genus, "handle", "handles"), ". Edges are within ", FormatPercent(built.strain.median),
      " (median) and ", FormatPercent(built.strain.p95), " (95 of 100) of the print.</p>\n");
  return PageHead("Weft template", absl::StrCat("Template ", garment.id), verdict, more);
}

}  // namespace

absl::StatusOr<std::string> MakeTemplateReport(const BuiltTemplate& built,
                                               const TemplateReportInputs& inputs) {
  WEFT_ASSIGN_OR_RETURN(const std::string sewn, SewnPictures(built));
  GarmentMap strain{"Distance from the print", "strain", "%", built.strain.of_vertex, {}};
  for (double& value : strain.values) value *= 100;
  strain.range = RoundRange(strain.values);
  WEFT_ASSIGN_OR_RETURN(const std::string map, GarmentMapHtml(built.garment.rest, strain));

  std::string html = HeadOf(built, inputs.verdict);
  std::string warnings;
  for (const std::string& warning : built.warnings) {
    absl::StrAppend(&warnings, "<li>", EscapeHtml(warning), "</li>\n");
  }
  if (!warnings.empty()) html += Section("warnings", "Warnings", absl::StrCat("<ul>", warnings, "</ul>"));
  html += Section("board", "Panels on the board",
                  absl::StrCat("<p>Panels have large numbers. Both sides of a seam have the same small "
                               "number and colour; grey outlines are open.</p>\n",
                               BoardPicture(built)));
  html += Section("garment", "The sewn garment", sewn);
  html += Section("texture", "Texture", TextureSection(built));
  html += Section("seams", "Seams", SeamTable(built));
  html += Section("borders", "Openings and closed holes", BorderTable(built));
  html += Section("strain", "Rest state", map);
  html += Section("panels", "Panels", PanelTable(built));
  std::vector<std::string> clouds;
  for (size_t i = 0; i < inputs.clouds.size(); ++i) {
    const bool reference = static_cast<int>(i) == built.reference;
    clouds.push_back(NameHtml(inputs.clouds[i]) + (reference ? " (its pose is the rest state's)" : ""));
  }
  html += Section(
      "inputs", "Inputs",
      absl::StrCat(
          "<p>Board ", NameHtml(inputs.board), ", cells of ", FormatNumber(built.parts.cell_mm, 2), " mm (",
          FormatNumber(built.measured_pitch_mm, 2), " mm apart in the clouds). Panels ",
          inputs.panels.empty() ? "as the clouds show them" : absl::StrCat("from ", NameHtml(inputs.panels)),
          "; ", FormatCount(built.filled_cells),
          " of their cells are in no cloud. Left out: ", FormatCount(built.contradicting_points),
          " points that contradict the cloth around them, ", FormatCount(built.speck_cells),
          " cells in pieces too small for a panel.</p>\n<p>Clouds: ", absl::StrJoin(clouds, ", "), "</p>\n"));
  return Page(absl::StrCat("Template ", built.garment.id), html);
}

}  // namespace weft
