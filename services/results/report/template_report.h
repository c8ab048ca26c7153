// The report of a template's build as one self-contained HTML page.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template_build/build_template.h"
#include "weft/v1/template.pb.h"

namespace weft {

// What the build started from, for the page's last section.
struct TemplateReportInputs {
  std::string board;
  std::string panels;               // empty: found in the clouds
  std::vector<std::string> clouds;  // BuiltTemplate::reference is one of them
};

// Panels on the board with seams in matching colours and numbers, the sewn garment, tables of panels, seams
// and borders, and how far the rest state is from the print. Loads nothing; the same bytes for the same
// arguments. Errors of RenderMesh.
absl::StatusOr<std::string> MakeTemplateReport(const BuiltTemplate& built, const v1::TemplateSummary& summary,
                                               const TemplateReportInputs& inputs);

}  // namespace weft
