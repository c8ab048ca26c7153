#include "services/results/evaluation/evaluation_text.h"

#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"

namespace weft {
namespace {

constexpr char kUnknown[] = "-";

std::string Percent(const std::optional<double>& share) {
  return share ? absl::StrFormat("%.2f %%", 100 * *share) : kUnknown;
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

// "0.536 mm/s", or "0.018 mm a frame" where the frame rate is not known.
std::string DriftText(const std::optional<ErrorSummary>& mm_s, const std::optional<ErrorSummary>& mm) {
  if (mm_s) return Number(mm_s, &ErrorSummary::mean) + " mm/s";
  return mm ? Number(mm, &ErrorSummary::mean) + " mm a frame" : kUnknown;
}

std::string Motion(const FrameMetrics& m) {
  std::string out;
  const auto mean = [](const std::optional<ErrorSummary>& errors) {
    return Number(errors, &ErrorSummary::mean);
  };
  if (m.texture_drift_mm)
    absl::StrAppendFormat(&out, "drift    %s by texture flow\n",
                          DriftText(m.texture_drift_mm_s, m.texture_drift_mm));
  if (m.true_drift_observed_mm || m.true_drift_inferred_mm)
    absl::StrAppendFormat(&out, "drift    %s against the truth where observed, %s where inferred\n",
                          DriftText(m.true_drift_observed_mm_s, m.true_drift_observed_mm),
                          DriftText(m.true_drift_inferred_mm_s, m.true_drift_inferred_mm));
  if (const auto& change = m.error_change_mm_s ? m.error_change_mm_s : m.error_change_mm)
    absl::StrAppendFormat(
        &out, "error    from frame to frame, seen by 3 or more: %s %s in the median, %s at 99 %%\n",
        Number(change, &ErrorSummary::median), m.error_change_mm_s ? "mm/s" : "mm a frame",
        Number(change, &ErrorSummary::p99));
  if (m.jitter_observed_mm)
    absl::StrAppendFormat(&out, "jitter   %s mm where observed, %s mm where inferred\n",
                          mean(m.jitter_observed_mm), mean(m.jitter_inferred_mm));
  if (m.error_jitter_observed_mm || m.error_jitter_inferred_mm)
    absl::StrAppendFormat(
        &out, "         %s mm of the error against the truth where observed, %s mm where inferred\n",
        mean(m.error_jitter_observed_mm), mean(m.error_jitter_inferred_mm));
  return out;
}

std::string Measures(const FrameMetrics& m) {
  std::string out;
  if (m.coverage)
    absl::StrAppendFormat(&out, "coverage %s of the cells seen by 3 cameras or more, %s by 2\n",
                          Percent(m.coverage), Percent(m.two_view_share));
  if (m.distortion_mm)
    absl::StrAppendFormat(&out, "geodesic %.2f mm of distortion, %.2f %% of the distance\n", *m.distortion_mm,
                          100 * m.distortion_relative.value_or(0));
  absl::StrAppend(&out, Motion(m));
  if (m.self_intersections)
    absl::StrAppend(&out, "self-intersections: ",
                    *m.self_intersections == 0
                        ? "none"
                        : absl::StrCat(FormatCount(*m.self_intersections), " pairs of faces in all frames"),
                    "\n");
  if (m.reprojection_px)
    absl::StrAppendFormat(&out, "cameras  %s px reprojection error, %s px with the camera left out\n",
                          Number(m.reprojection_px, &ErrorSummary::mean),
                          Number(m.left_out_px, &ErrorSummary::mean));
  return out;
}

std::string RecallByPitch(const DecodeScore& score) {
  std::string out;
  for (size_t k = 0; k < score.by_pitch.size(); ++k) {
    const auto& [scoreable, found] = score.by_pitch[k];
    if (scoreable == 0) continue;
    const bool is_last = k + 1 == score.by_pitch.size();
    absl::StrAppendFormat(
        &out, "         recall %s of %s cells from %.0f px %s\n",
        Percent(static_cast<double>(found) / static_cast<double>(scoreable)), FormatCount(scoreable),
        DecodeScore::kPitchClassesPx[k],
        is_last ? "on" : absl::StrFormat("to %.0f px", DecodeScore::kPitchClassesPx[k + 1]));
  }
  return out;
}

std::string ComparedWithPoints(const MeshScore& mesh) {
  std::string out;
  const auto line = [&out](const char* what, const std::optional<ErrorSummary>& e) {
    absl::StrAppendFormat(&out, "         %s %s mm in the median, %s at 95 %%, %s at 99 %%, %s at most\n",
                          what, Number(e, &ErrorSummary::median), Number(e, &ErrorSummary::p95),
                          Number(e, &ErrorSummary::p99), Number(e, &ErrorSummary::max));
  };
  if (mesh.point_mm.empty()) return out;
  absl::StrAppendFormat(&out, "         %s of them have a point:\n",
                        FormatCount(static_cast<int64_t>(mesh.point_mm.size())));
  line("  vertices", Summarize(mesh.with_point_mm));
  line("  points  ", Summarize(mesh.point_mm));
  return out;
}

std::string WrongOnes(const DecodeScore& score) {
  if (score.right == score.observations) return "";
  std::string out =
      absl::StrFormat("         %s wrong ones: %s of cells out of sight",
                      FormatCount(score.observations - score.right), FormatCount(score.out_of_sight));
  if (const auto wrong = Summarize(score.wrong_px)) {
    absl::StrAppendFormat(&out, ", the others off by %s px in the median, %s px at 95 %%",
                          Number(wrong, &ErrorSummary::median), Number(wrong, &ErrorSummary::p95));
  }
  return out + "\n";
}

std::string Counts(const FrameScore& total) {
  const auto count = [](size_t number) { return FormatCount(static_cast<int64_t>(number)); };
  std::string out;
  if (const auto& d = total.centers) {
    absl::StrAppendFormat(&out, "decode   %s of %s observed cells are right, %s of %s scoreable ones found\n",
                          count(d->right), count(d->observations), count(d->found), count(d->scoreable));
  }
  if (const auto& d = total.centers) absl::StrAppend(&out, WrongOnes(*d), RecallByPitch(*d));
  if (const auto& d = total.corners) {
    const auto errors = Summarize(d->errors_px);
    absl::StrAppendFormat(&out, "corners  precision %s, recall %s, %s px in the median, %s px at 95 %%\n",
                          Percent(d->Precision()), Percent(d->Recall()),
                          Number(errors, &ErrorSummary::median), Number(errors, &ErrorSummary::p95));
  }
  if (const auto& c = total.cloud) {
    absl::StrAppendFormat(&out,
                          "cloud    %s of %s vertex positions seen by 3 cameras or more have a point; %s "
                          "points, %s of cells that no camera sees\n",
                          count(c->covered), count(c->well_seen), count(c->points),
                          count(c->points_of_unseen_cells));
  }
  if (const auto& m = total.mesh) {
    absl::StrAppendFormat(&out, "mesh     %s vertex positions seen by 3 cameras or more, %s by fewer\n",
                          count(m->visible_mm.size()), count(m->hidden_mm.size()));
    const auto visible = Summarize(m->visible_mm);
    absl::StrAppendFormat(
        &out, "         %s mm at 99 %% where seen by 3 or more, %s mm at most, %s beyond %.0f mm\n",
        Number(visible, &ErrorSummary::p99), Number(visible, &ErrorSummary::max), Percent(m->FarShare()),
        MeshScore::kFarMm);
    absl::StrAppend(&out, ComparedWithPoints(*m));
  }
  return out;
}

// What could not be measured, and at which frame rate the rest was.
std::string Notes(const JobEvaluation& evaluation) {
  std::string out;
  if (evaluation.fps > 0)
    absl::StrAppendFormat(&out, "rate     %.2f frames/s, by %s\n", evaluation.fps, evaluation.fps_source);
  for (const EvaluationRemark& remark : evaluation.remarks)
    absl::StrAppendFormat(&out, "note     %s: %s\n", remark.metric, remark.reason);
  return out;
}

}  // namespace

std::string EvaluationTable(const JobEvaluation& evaluation) {
  if (evaluation.truth.empty()) return Measures(evaluation.total_metrics) + Notes(evaluation);
  std::string out = absl::StrFormat("%-8s | %-33s | %-24s | %s\n", "", "decode, cell centres",
                                    "cloud, seen by 3 or more", "mesh error in mm");
  absl::StrAppendFormat(&out, "%-8s | %8s %8s %7s %7s | %8s %7s %7s | %7s %7s %7s %7s\n", "frame", "precis.",
                        "recall", "med px", "p95 px", "covered", "med mm", "p95 mm", "visible", "p95",
                        "hidden", "p95");
  for (const EvaluatedFrame& frame : evaluation.frames) absl::StrAppend(&out, Line(frame.frame, frame.score));
  absl::StrAppend(&out, Line("total", evaluation.total), "\n", Counts(evaluation.total),
                  Measures(evaluation.total_metrics), Notes(evaluation));
  return out;
}

}  // namespace weft
