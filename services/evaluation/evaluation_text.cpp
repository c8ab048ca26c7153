#include "services/evaluation/evaluation_text.h"

#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace weft {
namespace {

constexpr char kUnknown[] = "-";

std::string Percent(const std::optional<double>& share) {
  return share ? absl::StrFormat("%.2f%%", 100 * *share) : kUnknown;
}

std::string Number(const std::optional<ErrorSummary>& errors, double ErrorSummary::*field) {
  return errors ? absl::StrFormat("%.3f", (*errors).*field) : kUnknown;
}

// frame | precision recall median p95 | coverage median p95 | visible mean p95, hidden mean p95
std::string Line(const std::string& name, const FrameScore& score) {
  std::string line = absl::StrFormat("%-8s", name);
  if (score.centers) {
    const auto errors = Summarize(score.centers->errors_px);
    absl::StrAppendFormat(&line, " | %8s %8s %7s %7s", Percent(score.centers->Precision()),
                          Percent(score.centers->Recall()), Number(errors, &ErrorSummary::median),
                          Number(errors, &ErrorSummary::p95));
  } else {
    absl::StrAppendFormat(&line, " | %-33s", "no observations.csv");
  }
  if (score.cloud) {
    const auto errors = Summarize(score.cloud->errors_mm);
    absl::StrAppendFormat(&line, " | %8s %7s %7s", Percent(score.cloud->Coverage()),
                          Number(errors, &ErrorSummary::median), Number(errors, &ErrorSummary::p95));
  } else {
    absl::StrAppendFormat(&line, " | %-24s", "no cloud.ply");
  }
  if (score.mesh) {
    const auto visible = Summarize(score.mesh->visible_mm), hidden = Summarize(score.mesh->hidden_mm);
    absl::StrAppendFormat(&line, " | %7s %7s %7s %7s", Number(visible, &ErrorSummary::mean),
                          Number(visible, &ErrorSummary::p95), Number(hidden, &ErrorSummary::mean),
                          Number(hidden, &ErrorSummary::p95));
  } else {
    absl::StrAppend(&line, " | no mesh.ply");
  }
  return line + "\n";
}

std::string Measures(const FrameMetrics& m) {
  std::string out;
  const auto mean = [](const std::optional<ErrorSummary>& errors) {
    return Number(errors, &ErrorSummary::mean);
  };
  if (m.coverage)
    absl::StrAppendFormat(
        &out, "coverage %s of the vertices with a cell are seen by three cameras or more, %s by two\n",
        Percent(m.coverage), Percent(m.two_view_share));
  if (m.distortion_mm)
    absl::StrAppendFormat(&out, "geodesic %.2f mm of distortion, %.2f%% of the distance\n", *m.distortion_mm,
                          100 * m.distortion_relative.value_or(0));
  if (m.texture_drift_mm_s)
    absl::StrAppendFormat(&out, "drift    %s mm/s by texture flow\n", mean(m.texture_drift_mm_s));
  if (m.true_drift_observed_mm_s || m.true_drift_inferred_mm_s)
    absl::StrAppendFormat(&out, "drift    %s mm/s against the truth where observed, %s where inferred\n",
                          mean(m.true_drift_observed_mm_s), mean(m.true_drift_inferred_mm_s));
  if (m.jitter_observed_mm)
    absl::StrAppendFormat(&out, "jitter   %s mm where observed, %s where inferred\n",
                          mean(m.jitter_observed_mm), mean(m.jitter_inferred_mm));
  if (m.error_jitter_observed_mm || m.error_jitter_inferred_mm)
    absl::StrAppendFormat(&out,
                          "         %s mm of the error against the truth where observed, %s where inferred\n",
                          mean(m.error_jitter_observed_mm), mean(m.error_jitter_inferred_mm));
  if (m.self_intersections)
    absl::StrAppendFormat(&out, "pairs    %d of faces that intersect, in all frames\n",
                          *m.self_intersections);
  if (m.reprojection_px)
    absl::StrAppendFormat(&out, "cameras  %s px reprojection error, %s px with the camera left out\n",
                          mean(m.reprojection_px), mean(m.left_out_px));
  return out;
}

std::string Counts(const FrameScore& total) {
  std::string out;
  if (const auto& d = total.centers) {
    absl::StrAppendFormat(&out, "decode   %d of %d observed cells are right, %d of %d scoreable ones found\n",
                          d->right, d->observations, d->found, d->scoreable);
  }
  if (const auto& d = total.corners) {
    const auto errors = Summarize(d->errors_px);
    absl::StrAppendFormat(&out, "corners  precision %s, recall %s, %s px in the median, %s px at 95 %%\n",
                          Percent(d->Precision()), Percent(d->Recall()),
                          Number(errors, &ErrorSummary::median), Number(errors, &ErrorSummary::p95));
  }
  if (const auto& c = total.cloud) {
    absl::StrAppendFormat(&out,
                          "cloud    %d of %d well seen vertices have a point; %d points, %d of cells that no "
                          "camera sees\n",
                          c->covered, c->well_seen, c->points, c->points_of_unseen_cells);
  }
  if (const auto& m = total.mesh) {
    absl::StrAppendFormat(&out,
                          "mesh     %d vertices are well seen, %d are hidden from all but few cameras\n",
                          m->visible_mm.size(), m->hidden_mm.size());
  }
  return out;
}

}  // namespace

std::string EvaluationTable(const JobEvaluation& evaluation) {
  if (evaluation.truth.empty()) {
    std::string out = Measures(evaluation.total_metrics);
    for (const EvaluationRemark& remark : evaluation.remarks)
      absl::StrAppendFormat(&out, "note     %s: %s\n", remark.metric, remark.reason);
    return out;
  }
  std::string out = absl::StrFormat("%-8s | %-33s | %-24s | %s\n", "", "decode, cell centres",
                                    "cloud, of well seen", "mesh error in mm");
  absl::StrAppendFormat(&out, "%-8s | %8s %8s %7s %7s | %8s %7s %7s | %7s %7s %7s %7s\n", "frame", "precis.",
                        "recall", "med px", "p95 px", "covered", "med mm", "p95 mm", "visible", "p95",
                        "hidden", "p95");
  for (const EvaluatedFrame& frame : evaluation.frames) absl::StrAppend(&out, Line(frame.frame, frame.score));
  absl::StrAppend(&out, Line("total", evaluation.total), "\n", Counts(evaluation.total),
                  Measures(evaluation.total_metrics));
  for (const EvaluationRemark& remark : evaluation.remarks)
    absl::StrAppendFormat(&out, "note     %s: %s\n", remark.metric, remark.reason);
  return out;
}

}  // namespace weft
