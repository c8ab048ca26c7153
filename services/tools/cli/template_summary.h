// What a template is, in numbers and in words.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "alignment/garment_parts.h"
#include "alignment/template.h"
#include "alignment/template_check.h"
#include "weft/v1/template.pb.h"

namespace weft {

// FailedPrecondition names the first non-manifold point of the mesh: an edge of three faces, faces of
// opposite orientation, pieces that touch in a vertex. It also names parts of template.json that are not
// in the mesh: sides of seams that no edges join, openings that are no borders.
absl::StatusOr<v1::TemplateSummary> SummarizeTemplate(const Template& garment, const GarmentParts& parts);

// The garment whose size is furthest from the print.
void AddPrintScale(const TemplateSize& size, v1::TemplateSummary* summary);

// FailedPrecondition lists the openings where there are others than `expected`; -1 takes any.
absl::Status CheckOpeningCount(const v1::TemplateSummary& summary, int expected);

// "5 panels, 4 seams, 4 openings, 13,000 vertices".
std::string TemplateHeadline(const v1::TemplateSummary& summary);
// By the limits of docs/verdicts.md; warnings, handles and loose pieces make it usable.
v1::Verdict TemplateVerdict(const v1::TemplateSummary& summary);

std::string TemplateSummaryText(const v1::TemplateSummary& summary);

// The name of the folder that a template is written to.
std::string TemplateIdOf(const std::string& folder);

}  // namespace weft
