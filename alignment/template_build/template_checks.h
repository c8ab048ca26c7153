// Whether a sewn mesh is the garment that was expected, in words that help to find what is wrong.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "alignment/template_build/build_template.h"
#include "alignment/template_build/mesh_topology.h"

namespace weft {

std::vector<TemplatePanel> DescribePanels(const PanelSheet& sheet);
// "panel 2 (rows 3 to 250, columns 10 to 300)"
std::string PanelText(const std::vector<TemplatePanel>& panels, int panel);

// "panel 1 (rows 3 to 9, columns 4 to 4) and panel 2 (...), 87 mm long, 4 mm apart (up to 6)"
std::string SeamText(const PanelSheet& sheet, const Seam& seam);

// Its length is that over the panels' own vertices.
TemplateBorder DescribeBorder(const PanelSheet& sheet, const std::vector<int>& loop,
                              const std::vector<Eigen::Vector3d>& position_mm);

// FailedPrecondition names panels that no seam ties to the others.
absl::Status CheckSewnTogether(const PanelSheet& sheet, const std::vector<Seam>& seams);
// FailedPrecondition for borders that look like a seam but are too far apart.
absl::Status CheckNearSeams(const PanelSheet& sheet, const std::vector<Seam>& near_seams, double max_gap_mm);
// FailedPrecondition: other openings than expected (each named), or handles.
absl::Status CheckOpenings(const BuiltTemplate& built, const TemplateBuildOptions& options,
                           const MeshTopology& topology);

}  // namespace weft
