#include "services/results/report/paper_table.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "services/results/report/html_text.h"
#include "services/results/report/report_sections.h"

namespace weft {
namespace {

// Fig. 7.
constexpr PaperFigures kPaperCoverage{.coverage = 0.75, .lowest_coverage = 0.54, .highest_coverage = 0.90};

std::string CoverageText(const PaperFigures& figures) {
  if (!std::isfinite(figures.coverage)) return kDash;
  if (!std::isfinite(figures.lowest_coverage)) return FormatPercent(figures.coverage);
  return absl::StrCat(FormatPercent(figures.coverage), " (", FormatPercent(figures.lowest_coverage), " to ",
                      FormatPercent(figures.highest_coverage), ")");
}

std::string PaperRow(const std::string& method, const PaperFigures& figures) {
  return TableRow("td", {method, FormatNumber(figures.drift_mm_s, 2),
                         FormatNumber(figures.geodesic_distortion_mm, 2), CoverageText(figures)});
}

}  // namespace

const std::vector<PublishedScore>& PaperTable1() {
  static const std::vector<PublishedScore> kRows = {
      {"Halimi et al. 2022, pattern registration", 1.50, 9.27},
      {"Halimi et al. 2022, pattern registration, big pattern (4 mm)", 0.77, 9.98},
      {"Body tracking + non-rigid ICP (Pons-Moll et al. 2017)", 72.3, 25.94},
      {"Body tracking + non-rigid ICP + IR optimization (Xiang et al. 2021)", 64.6, 35.49}};
  return kRows;
}

void AddPaperTable(google::protobuf::RepeatedPtrField<v1::PaperMethod>& table) {
  for (const PublishedScore& row : PaperTable1()) {
    v1::PaperMethod& method = *table.Add();
    method.set_method(row.method);
    method.set_drift_mm_s(row.drift_mm_s);
    method.set_geodesic_distortion_mm(row.geodesic_distortion_mm);
  }
}

std::string PaperSection(const PaperFigures& ours) {
  std::string rows = PaperRow("<b>This result</b>", ours);
  for (const PublishedScore& published : PaperTable1()) {
    PaperFigures figures{published.drift_mm_s, published.geodesic_distortion_mm};
    if (&published == &PaperTable1().front()) {
      figures.coverage = kPaperCoverage.coverage;
      figures.lowest_coverage = kPaperCoverage.lowest_coverage;
      figures.highest_coverage = kPaperCoverage.highest_coverage;
    }
    rows += PaperRow(EscapeHtml(published.method), figures);
  }
  const bool is_complete = std::isfinite(ours.drift_mm_s) && std::isfinite(ours.geodesic_distortion_mm);
  return Section(
      "paper", "Beside the paper",
      absl::StrCat(
          Table({"Method", "Correspondence drift rate, mm/s", "Geodesic distortion, mm",
                 "Coverage per frame, mean (lowest to highest)"},
                rows, "cameras"),
          is_complete
              ? ""
              : "<p><code>weft evaluate RESULT --out RESULT</code> measures drift and distortion, and "
                "writes this page anew with them.</p>\n",
          "<p>The other lines are Table 1 and Figure 7 of Halimi et al. 2022, measured on that paper's own "
          "recordings of worn shirts, which are not public: another garment, other motion, another frame "
          "rate. "
          "Drift: optical flow between consecutive unwrapped textures. Distortion: mean change of exact "
          "geodesic "
          "distances from seeded sources, here against the template, there against a T-pose. Coverage: share "
          "of "
          "the cells measured by three cameras or more.</p>\n"));
}

}  // namespace weft
