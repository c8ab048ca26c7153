#include "services/evaluation/evaluation_text.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/files/json_file.h"
#include "weft/v1/evaluation.pb.h"

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

// JSON writes 64-bit numbers as strings, so counts are 32 bits wide there.
uint32_t Count(int64_t count) {
  return static_cast<uint32_t>(std::min<int64_t>(count, std::numeric_limits<uint32_t>::max()));
}

std::optional<v1::ErrorSummary> ToProto(const std::vector<double>& errors) {
  const std::optional<ErrorSummary> summary = Summarize(errors);
  if (!summary) return std::nullopt;
  v1::ErrorSummary out;
  out.set_count(Count(summary->count));
  out.set_mean(summary->mean);
  out.set_median(summary->median);
  out.set_p95(summary->p95);
  out.set_max(summary->max);
  return out;
}

v1::DecodeScore ToProto(const DecodeScore& score) {
  v1::DecodeScore out;
  out.set_observations(Count(score.observations));
  out.set_right(Count(score.right));
  out.set_scoreable(Count(score.scoreable));
  out.set_found(Count(score.found));
  if (const auto precision = score.Precision()) out.set_precision(*precision);
  if (const auto recall = score.Recall()) out.set_recall(*recall);
  if (const auto errors = ToProto(score.errors_px)) *out.mutable_error_px() = *errors;
  return out;
}

v1::CloudScore ToProto(const CloudScore& score) {
  v1::CloudScore out;
  out.set_points(Count(score.points));
  out.set_points_of_unseen_cells(Count(score.points_of_unseen_cells));
  out.set_well_seen_vertices(Count(score.well_seen));
  out.set_covered_vertices(Count(score.covered));
  if (const auto coverage = score.Coverage()) out.set_coverage(*coverage);
  if (const auto errors = ToProto(score.errors_mm)) *out.mutable_error_mm() = *errors;
  return out;
}

v1::FrameScore ToProto(const std::string& name, const std::vector<std::string>& missing,
                       const FrameScore& score) {
  v1::FrameScore out;
  out.set_frame(name);
  for (const std::string& file : missing) out.add_missing(file);
  if (score.centers) *out.mutable_centers() = ToProto(*score.centers);
  if (score.corners) *out.mutable_corners() = ToProto(*score.corners);
  if (score.cloud) *out.mutable_cloud() = ToProto(*score.cloud);
  if (score.mesh) {
    v1::MeshScore& mesh = *out.mutable_mesh();
    if (const auto visible = ToProto(score.mesh->visible_mm)) *mesh.mutable_visible_mm() = *visible;
    if (const auto hidden = ToProto(score.mesh->hidden_mm)) *mesh.mutable_hidden_mm() = *hidden;
  }
  return out;
}

}  // namespace

std::string EvaluationTable(const JobEvaluation& evaluation) {
  std::string out = absl::StrFormat("%-8s | %-33s | %-24s | %s\n", "", "decode, cell centres",
                                    "cloud, of well seen", "mesh error in mm");
  absl::StrAppendFormat(&out, "%-8s | %8s %8s %7s %7s | %8s %7s %7s | %7s %7s %7s %7s\n", "frame", "precis.",
                        "recall", "med px", "p95 px", "covered", "med mm", "p95 mm", "visible", "p95",
                        "hidden", "p95");
  for (const EvaluatedFrame& frame : evaluation.frames) absl::StrAppend(&out, Line(frame.frame, frame.score));
  return absl::StrCat(out, Line("total", evaluation.total), "\n", Counts(evaluation.total));
}

absl::StatusOr<std::string> EvaluationJson(const JobEvaluation& evaluation) {
  v1::Evaluation out;
  for (const EvaluatedFrame& frame : evaluation.frames)
    *out.add_frames() = ToProto(frame.frame, frame.missing, frame.score);
  *out.mutable_total() = ToProto("total", {}, evaluation.total);
  return ToJson(out);
}

}  // namespace weft
