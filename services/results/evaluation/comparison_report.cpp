#include "services/results/evaluation/comparison_report.h"

#include <filesystem>
#include <map>
#include <optional>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/results/evaluation/comparison_sequence.h"
#include "services/results/evaluation/comparison_text.h"
#include "services/results/report/html_text.h"
#include "services/results/report/report_sections.h"
#include "services/results/report/verdict_html.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

std::string ValueHtml(const EvaluationMeasure& measure, double value, int more_decimals = 0) {
  const bool is_share = std::string_view(measure.unit) == "%";
  return FormatNumber(is_share ? 100 * value : value, measure.decimals + more_decimals);
}

std::string OutcomeHtml(ComparisonOutcome outcome) {
  switch (outcome) {
    case ComparisonOutcome::kABetter:
      return "<span class=\"side a\">&#9679; A is better</span>";
    case ComparisonOutcome::kBBetter:
      return "<span class=\"side b\">&#9632; B is better</span>";
    default:
      return EscapeHtml(OutcomeText(outcome));
  }
}

std::string HeadOfComparison(const JobComparison& comparison) {
  const auto side = [](const char* name, const char* mark, const JobEvaluation& of) {
    return absl::StrCat("<li><span class=\"side ", mark, "\">", name, "</span> ", NameHtml(of.result),
                        "</li>\n");
  };
  return PageHead(
      absl::StrCat("Weft comparison of two results",
                   comparison.a.truth.empty() ? ", without ground truth" : ", against ground truth"),
      ComparisonHeadline(comparison) + ".", {},
      absl::StrCat("<ul class=\"sides\">\n", side("&#9679; A", "a", comparison.a),
                   side("&#9632; B", "b", comparison.b), "</ul>\n"));
}

std::string MeasureSection(const JobComparison& comparison) {
  std::string rows;
  for (const ComparedMeasure& compared : comparison.measures) {
    const EvaluationMeasure& m = *compared.measure;
    const std::string unit = *m.unit == '\0' ? "" : absl::StrCat(", ", m.unit);
    rows += TableRow("td", {absl::StrCat(m.title, unit), ValueHtml(m, compared.a), ValueHtml(m, compared.b),
                            ValueHtml(m, compared.a - compared.b, 1),
                            compared.test ? absl::StrCat("\xC2\xB1\xC2\xA0",
                                                         ValueHtml(m, compared.test->standard_error, 1))
                                          : kDash,
                            FormatCount(static_cast<int64_t>(compared.frames)),
                            compared.test ? EscapeHtml(ProbabilityText(compared.test->p)) : kDash,
                            compared.test ? EscapeHtml(ProbabilityText(compared.p_adjusted)) : kDash,
                            OutcomeHtml(compared.outcome)});
  }
  const FrameDifference& total = comparison.total;
  std::string distance;
  if (total.distance_mm)
    absl::StrAppend(&distance, "<p>Vertices of both are ", FormatNumber(total.distance_mm->mean, 3),
                    " mm apart in the mean, ", FormatNumber(total.distance_mm->median, 3),
                    " mm in the median, ", FormatNumber(total.distance_mm->p95, 3), " mm at 95 %");
  if (total.beyond_sigmas_share)
    absl::StrAppend(&distance, "; ", FormatPercent(*total.beyond_sigmas_share),
                    " of them farther than the sigmas of both explain in 99 % of cases");
  if (!distance.empty()) distance += ".</p>\n";
  return Section(
      "measures", "Side by side",
      absl::StrCat(
          Table({"Mean over the frames", "A", "B", "A \xE2\x88\x92 B", "Standard error", "Frames", "p",
                 "p, all", "Outcome"},
                rows, "cameras outcomes"),
          distance,
          "<p>Each frame of A is paired with the same frame of B. p is the probability that chance makes "
          "such a difference; it allows for frames that resemble their neighbours (Lazarus et al. 2018). "
          "<i>p, "
          "all</i> allows for the number of measures as well (Holm 1979). Where that is below ",
          FormatNumber(kSignificanceLevel, 2), " a difference is called significant.</p>\n"));
}

std::string JobDifferenceSection(const JobComparison& comparison) {
  if (comparison.differences.empty()) return "";
  std::string rows;
  for (const JobDifference& difference : comparison.differences)
    rows += TableRow("td", {absl::StrCat("<code>", EscapeHtml(difference.what), "</code>"),
                            difference.a.empty() ? kDash : NameHtml(difference.a),
                            difference.b.empty() ? kDash : NameHtml(difference.b)});
  return Section("differences", "What differs in the jobs", Table({"", "A", "B"}, rows, "facts"));
}

std::string DifferenceMapSection(const JobComparison& comparison) {
  if (comparison.a.shape.vertices_mm.empty()) return "";
  std::string body;
  for (const auto& [name, map] : ComparisonMaps(comparison)) {
    const absl::StatusOr<std::string> html = GarmentMapHtml(comparison.a.shape, map);
    absl::StrAppend(&body, html.ok()
                               ? *html
                               : absl::StrCat("<p>", EscapeHtml(map.title), " has no picture: ",
                                              EscapeHtml(std::string(html.status().message())), "</p>\n"));
  }
  if (body.empty()) return "";
  return Section(
      "maps", "Differences on the garment",
      absl::StrCat("<div class=\"meshes\">\n", body,
                   "</div>\n<p>Dark grey: not measured in both. Results of the same images share their "
                   "noise, so a distance beyond the sigmas is no chance.</p>\n"));
}

std::string OverlaySection(const JobComparison& comparison) {
  std::string body;
  const PlotFrames axis = ComparisonFrames(comparison);
  for (const ComparisonPlot& plot : ComparisonPlots(comparison))
    body += OverlaidPlot(axis, plot.series, plot.text);
  if (body.empty()) return "";
  return Section("plots", "Over the frames", absl::StrCat("<div class=\"plots\">\n", body, "</div>\n"));
}

std::string ComparedCameraSection(const JobComparison& comparison) {
  std::map<std::string, std::pair<const CameraErrors*, const CameraErrors*>> cameras;
  for (const CameraErrors& camera : comparison.a.cameras) cameras[camera.camera_id].first = &camera;
  for (const CameraErrors& camera : comparison.b.cameras) cameras[camera.camera_id].second = &camera;
  if (cameras.empty()) return "";
  std::string rows;
  for (const auto& [name, sides] : cameras) {
    std::vector<std::string> reprojection, left_out, shift;
    for (const CameraErrors* camera : {sides.first, sides.second}) {
      const auto error = camera ? Summarize(camera->reprojection_px) : std::nullopt;
      const auto others = camera ? Summarize(camera->left_out_px) : std::nullopt;
      reprojection.push_back(FormatNumber(error ? error->median : kNoNumber, 3));
      left_out.push_back(FormatNumber(others ? others->median : kNoNumber, 3));
      shift.push_back(FormatNumber(
          others ? camera->shift_sum_px.norm() / static_cast<double>(others->count) : kNoNumber, 3));
    }
    rows += TableRow("td", {NameHtml(name), reprojection[0], reprojection[1], left_out[0], left_out[1],
                            shift[0], shift[1]});
  }
  return Section("cameras", "Cameras",
                 Table({"Camera", "Reprojection, median px, A", "B", "Left out, median px, A", "B",
                        "Mean shift, px, A", "B"},
                       rows, "cameras"));
}

std::string ComparisonRemarkSection(const JobComparison& comparison) {
  std::string rows;
  const auto add = [&rows](const std::string& side, const std::vector<EvaluationRemark>& remarks) {
    for (const EvaluationRemark& remark : remarks)
      rows += TableRow("td", {side, EscapeHtml(remark.metric), EscapeHtml(remark.reason)});
  };
  add("both", comparison.remarks);
  add("A", comparison.a.remarks);
  add("B", comparison.b.remarks);
  if (rows.empty()) return "";
  return Section("remarks", "Not measured, and assumptions", Table({"", "Measure", "Why"}, rows, "facts"));
}

}  // namespace

std::string MakeComparisonReport(const JobComparison& comparison, const SequenceView* sequence,
                                 const std::vector<std::string>& notes) {
  return Page(
      "Weft comparison",
      absl::StrCat(HeadOfComparison(comparison), MeasureSection(comparison), JobDifferenceSection(comparison),
                   sequence != nullptr ? ComparisonSequenceSection(comparison, *sequence, notes) : "",
                   DifferenceMapSection(comparison), OverlaySection(comparison),
                   ComparedCameraSection(comparison), ComparisonRemarkSection(comparison)),
      sequence != nullptr ? SequenceProgram(*sequence) : PageProgram());
}

absl::Status WriteComparison(const std::string& folder, const JobComparison& comparison) {
  WEFT_ASSIGN_OR_RETURN(const std::string json, ComparisonJson(comparison));
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
  const std::optional<SequenceView> sequence = ComparisonSequence(comparison, notes);
  write("report.html", MakeComparisonReport(comparison, sequence ? &*sequence : nullptr, notes));
  return status;
}

}  // namespace weft
