#include "alignment/template_build/template_checks.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace weft {
namespace {

// The rows and columns that a run of vertices covers.
std::string PlaceText(const PanelSheet& sheet, const std::vector<int>& vertices) {
  int first_row = 1 << 30, last_row = -1, first_col = 1 << 30, last_col = -1;
  for (const int v : vertices) {
    const auto [row, col, kind] = sheet.cell_of_vertex[v];
    first_row = std::min(first_row, row), last_row = std::max(last_row, row);
    first_col = std::min(first_col, col), last_col = std::max(last_col, col);
  }
  return absl::StrCat("rows ", first_row, " to ", last_row, ", columns ", first_col, " to ", last_col);
}

std::string BorderText(const TemplateBorder& border) {
  std::vector<int> names = border.panels;
  for (int& name : names) ++name;
  return absl::StrCat(std::lround(border.length_mm), " mm along panel", names.size() == 1 ? " " : "s ",
                      absl::StrJoin(names, ", "));
}

std::string BordersText(const std::vector<TemplateBorder>& borders) {
  std::vector<std::string> texts;
  for (const TemplateBorder& border : borders) texts.push_back(BorderText(border));
  return texts.empty() ? "none" : absl::StrJoin(texts, "; ");
}

}  // namespace

std::vector<TemplatePanel> DescribePanels(const PanelSheet& sheet) {
  std::vector<TemplatePanel> panels(sheet.panels);
  for (size_t v = 0; v < sheet.cell_of_vertex.size(); ++v) {
    TemplatePanel& panel = panels[sheet.panel_of_vertex[v]];
    const auto [row, col, kind] = sheet.cell_of_vertex[v];
    const bool first = panel.cells++ == 0;
    panel.first_row = first ? row : std::min(panel.first_row, row);
    panel.last_row = first ? row : std::max(panel.last_row, row);
    panel.first_col = first ? col : std::min(panel.first_col, col);
    panel.last_col = first ? col : std::max(panel.last_col, col);
  }
  return panels;
}

std::string PanelText(const std::vector<TemplatePanel>& panels, int panel) {
  const TemplatePanel& p = panels[panel];
  return absl::StrCat("panel ", panel + 1, " (rows ", p.first_row, " to ", p.last_row, ", columns ",
                      p.first_col, " to ", p.last_col, ")");
}

TemplateBorder DescribeBorder(const PanelSheet& sheet, const std::vector<int>& loop,
                              const std::vector<Eigen::Vector3d>& position_mm) {
  std::set<int> panels;
  std::vector<int> in_panels;
  for (const int v : loop) {
    if (v >= static_cast<int>(sheet.panel_of_vertex.size())) continue;
    panels.insert(sheet.panel_of_vertex[v]);
    in_panels.push_back(v);
  }
  return {loop, LoopLengthMm(in_panels, position_mm), {panels.begin(), panels.end()}};
}

absl::Status CheckSewnTogether(const PanelSheet& sheet, const std::vector<Seam>& seams) {
  std::vector<int> group(sheet.panels);
  std::iota(group.begin(), group.end(), 0);
  for (const Seam& seam : seams) {
    const int from = std::max(group[seam.panel_a], group[seam.panel_b]);
    const int to = std::min(group[seam.panel_a], group[seam.panel_b]);
    std::replace(group.begin(), group.end(), from, to);
  }
  const std::vector<TemplatePanel> panels = DescribePanels(sheet);
  std::vector<std::string> loose;
  for (int panel = 0; panel < sheet.panels; ++panel) {
    if (group[panel] != 0) loose.push_back(PanelText(panels, panel));
  }
  if (loose.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(
      "no seam was found between panel 1 with what is sewn to it, and ", absl::StrJoin(loose, ", "),
      ". Add a cloud that shows the cloth on both sides of that seam; raise --max-seam-gap-mm when the "
      "visible cells end far from it; if this is no part of the garment, leave it out of --panels"));
}

std::string SeamText(const PanelSheet& sheet, const Seam& seam) {
  return absl::StrCat("panel ", seam.panel_a + 1, " (", PlaceText(sheet, seam.side_a), ") and panel ",
                      seam.panel_b + 1, " (", PlaceText(sheet, seam.side_b), "), ",
                      std::lround(seam.length_mm), " mm long, ", std::lround(seam.gap_mm),
                      " mm apart (up to ", std::lround(seam.max_gap_mm), ")");
}

absl::Status CheckNearSeams(const PanelSheet& sheet, const std::vector<Seam>& near_seams, double max_gap_mm) {
  if (near_seams.empty()) return absl::OkStatus();
  std::vector<std::string> texts;
  double most_mm = 0;
  for (const Seam& seam : near_seams) {
    most_mm = std::max(most_mm, seam.max_gap_mm);
    texts.push_back(absl::StrCat("between ", SeamText(sheet, seam)));
  }
  return absl::FailedPreconditionError(absl::StrCat(
      "borders run along each other like a seam, but further apart than ", std::lround(max_gap_mm), " mm: ",
      absl::StrJoin(texts, "; "), ". If they are sewn, give --max-seam-gap-mm ", std::ceil(1.1 * most_mm),
      " or add a cloud that shows the cloth there; if they are not, give --allow-open-seams"));
}

absl::Status CheckOpenings(const BuiltTemplate& built, const TemplateBuildOptions& options,
                           const MeshTopology& topology) {
  const int found = static_cast<int>(topology.loops.size());
  if (options.openings >= 0 && found != options.openings) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the sewn garment has ", found, " openings, expected were ", options.openings,
        ". Openings: ", BordersText(built.parts.openings), ". ",
        found > options.openings
            ? "The shortest of them are holes or seams that were not closed: add a cloud that shows the "
              "cloth there, or raise --max-hole-mm"
            : "A seam may close what is open in the garment: give a cloud of a pose in which its borders are "
              "apart, or lower --max-seam-gap-mm"));
  }
  if (topology.genus != 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("the sewn garment has ", topology.genus,
                     " handle(s), like a cup: borders are sewn together that "
                     "merely touch. Openings: ",
                     BordersText(built.parts.openings),
                     ". Add a cloud of a pose in which they are apart, or lower --max-seam-gap-mm"));
  }
  return absl::OkStatus();
}

}  // namespace weft
