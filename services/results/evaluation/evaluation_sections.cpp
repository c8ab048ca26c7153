#include "services/results/evaluation/evaluation_sections.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/files/frame_paths.h"
#include "services/results/evaluation/evaluation_text.h"
#include "services/results/evaluation/evaluation_verdict.h"
#include "services/results/report/html_text.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/paper_table.h"
#include "services/results/report/picture_html.h"
#include "services/results/report/plot.h"
#include "services/results/report/report_sections.h"
#include "services/results/report/verdict_html.h"

namespace weft {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double MeanOr(const std::optional<ErrorSummary>& errors) { return errors ? errors->mean : kNone; }
// Drift of all or of one frame: per second, or per frame where the frame rate is not known.
using DriftField = std::optional<ErrorSummary> FrameMetrics::*;
struct Drift {
  DriftField per_second, per_frame;
};
constexpr Drift kTextureDrift{&FrameMetrics::texture_drift_mm_s, &FrameMetrics::texture_drift_mm};
constexpr Drift kObservedDrift{&FrameMetrics::true_drift_observed_mm_s,
                               &FrameMetrics::true_drift_observed_mm};
constexpr Drift kInferredDrift{&FrameMetrics::true_drift_inferred_mm_s,
                               &FrameMetrics::true_drift_inferred_mm};
DriftField FieldOf(const JobEvaluation& evaluation, const Drift& drift) {
  return evaluation.fps > 0 ? drift.per_second : drift.per_frame;
}
const char* DriftUnit(const JobEvaluation& evaluation) { return evaluation.fps > 0 ? "mm/s" : "mm a frame"; }

double ValueOr(const std::optional<double>& value) { return value.value_or(kNone); }

std::string Shown(double value, int decimals, const char* unit) {
  return std::isfinite(value) ? absl::StrCat(FormatNumber(value, decimals), "\xC2\xA0", unit) : kDash;
}

std::string Tile(const char* what, const std::string& value, const std::string& detail) {
  return absl::StrCat("<div class=\"tile\"><span>", what, "</span><b>", value, "</b><small>", detail,
                      "</small></div>\n");
}

// Mean error of a kind of vertices over all frames.
double MeshErrorMm(const JobEvaluation& evaluation, ErrorTally MeshScore::*kind) {
  if (!evaluation.total.mesh) return kNone;
  return MeanOr(Summarize((*evaluation.total.mesh).*kind));
}

PlotFrames FrameAxis(const JobEvaluation& evaluation) {
  PlotFrames axis;
  for (const EvaluatedFrame& frame : evaluation.frames) {
    axis.names.push_back(frame.frame);
    axis.without_mesh.push_back(std::ranges::find(frame.missing, FileName(FrameFile::kMesh)) !=
                                frame.missing.end());
  }
  return axis;
}

using FrameValue = std::function<double(const EvaluatedFrame&)>;

std::string PlotOf(const JobEvaluation& evaluation, const PlotText& text, const FrameValue& value) {
  std::vector<double> values;
  bool any = false;
  for (const EvaluatedFrame& frame : evaluation.frames) {
    values.push_back(value(frame));
    any = any || std::isfinite(values.back());
  }
  return any ? LinePlot(FrameAxis(evaluation), values, text) : "";
}

FrameValue MeanOfMetric(std::optional<ErrorSummary> FrameMetrics::*field) {
  return [field](const EvaluatedFrame& frame) { return MeanOr(frame.metrics.*field); };
}

FrameValue MeanOfMesh(ErrorTally MeshScore::*kind) {
  return [kind](const EvaluatedFrame& frame) {
    return frame.score.mesh ? MeanOr(Summarize((*frame.score.mesh).*kind)) : kNone;
  };
}

double Pairs(const EvaluatedFrame& frame) {
  return frame.metrics.self_intersections ? static_cast<double>(*frame.metrics.self_intersections) : kNone;
}

}  // namespace

std::string EvaluationHead(const JobEvaluation& evaluation) {
  const FrameMetrics& total = evaluation.total_metrics;
  const double visible_mm = MeshErrorMm(evaluation, &MeshScore::visible_mm),
               hidden_mm = MeshErrorMm(evaluation, &MeshScore::hidden_mm);
  const auto drift = [&](const Drift& of) {
    return Shown(MeanOr(total.*FieldOf(evaluation, of)), evaluation.fps > 0 ? 2 : 3, DriftUnit(evaluation));
  };
  std::string tiles = "<div class=\"tiles\">\n";
  tiles += Tile("Vertex error, seen by 3 or more", Shown(visible_mm, 3, "mm"),
                absl::StrCat("seen by fewer ", Shown(hidden_mm, 3, "mm")));
  tiles += Tile("Correspondence drift", drift(kTextureDrift),
                absl::StrCat("texture flow; exact ", drift(kObservedDrift), " where observed"));
  tiles += Tile("Geodesic distortion", Shown(ValueOr(total.distortion_mm), 2, "mm"),
                total.distortion_relative
                    ? absl::StrCat(FormatPercent(*total.distortion_relative), " of the distance")
                    : "against the template");
  tiles += Tile("Left-out camera error", Shown(MeanOr(total.left_out_px), 3, "px"),
                absl::StrCat("reprojection ", Shown(MeanOr(total.reprojection_px), 3, "px")));
  tiles += Tile("Self-intersections",
                !total.self_intersections        ? kDash
                : *total.self_intersections == 0 ? "none"
                                                 : FormatCount(*total.self_intersections),
                "pairs of faces, all frames");
  tiles += Tile("Jitter", Shown(MeanOr(total.jitter_observed_mm), 3, "mm"),
                absl::StrCat("inferred ", Shown(MeanOr(total.jitter_inferred_mm), 3, "mm")));
  tiles += Tile("Frames a second", evaluation.fps > 0 ? FormatNumber(evaluation.fps, 2) : "not known",
                evaluation.fps > 0 ? absl::StrCat("by ", EscapeHtml(evaluation.fps_source))
                                   : "drift is given per frame; --fps gives it per second");
  return PageHead(
      absl::StrCat("Weft evaluation of ", NameHtml(evaluation.result),
                   evaluation.truth.empty() ? ", without ground truth" : ", against ground truth"),
      EvaluationHeadline(evaluation) + ".", evaluation.verdict, tiles + "</div>\n");
}

PaperFigures FiguresOf(const JobEvaluation& evaluation) {
  PaperFigures figures;
  figures.drift_mm_s = MeanOr(evaluation.total_metrics.texture_drift_mm_s);
  figures.geodesic_distortion_mm = ValueOr(evaluation.total_metrics.distortion_mm);
  figures.coverage = ValueOr(evaluation.total_metrics.coverage);
  for (const EvaluatedFrame& frame : evaluation.frames) {
    if (!frame.metrics.coverage) continue;
    const double coverage = *frame.metrics.coverage;
    if (!(figures.lowest_coverage <= coverage)) figures.lowest_coverage = coverage;
    if (!(figures.highest_coverage >= coverage)) figures.highest_coverage = coverage;
  }
  return figures;
}

std::string MapSection(const JobEvaluation& evaluation) {
  if (evaluation.shape.vertices_mm.empty()) return "";
  std::string body;
  const auto add = [&](const GarmentMap& map) {
    if (map.values.empty()) return;
    const absl::StatusOr<std::string> html = GarmentMapHtml(evaluation.shape, map);
    absl::StrAppend(&body, html.ok()
                               ? *html
                               : absl::StrCat("<p>", map.title, " has no picture: ",
                                              EscapeHtml(std::string(html.status().message())), "</p>\n"));
  };
  const VertexMaps& maps = evaluation.maps;
  const char* drift_unit = DriftUnit(evaluation);
  add(ShareMap("Visibility: share of the frames that observe the vertex", "share", maps.visibility));
  add({"Vertex error, mean over the frames", "error", "mm", maps.error_mm, RoundRange(maps.error_mm)});
  add({"Geodesic distortion, mean over sources and frames", "distortion", "mm", maps.distortion_mm,
       RoundRange(maps.distortion_mm)});
  add({"Drift by texture flow", "drift", drift_unit, maps.texture_drift, RoundRange(maps.texture_drift)});
  add({"Exact drift", "drift", drift_unit, maps.true_drift, RoundRange(maps.true_drift, 0.95)});
  if (body.empty()) return "";
  return Section("maps", "On the garment", absl::StrCat("<div class=\"meshes\">\n", body, "</div>\n"));
}

std::string VisibilitySection(const JobEvaluation& evaluation) {
  if (evaluation.maps.visibility.empty()) return "";
  PlotFrames axis;
  axis.noun = "observed in";
  std::vector<double> share;
  double all = 0;
  const std::array<int, 10> counts = VisibilityHistogram(evaluation.maps.visibility);
  for (size_t i = 0; i < counts.size(); ++i) {
    axis.names.push_back(absl::StrFormat("%d\xE2\x80\x93%d %%", 10 * i, 10 * (i + 1)));
    axis.without_mesh.push_back(false);
    all += counts[i];
  }
  for (const int count : counts) share.push_back(all > 0 ? count / all : kNone);
  std::string body = "<div class=\"plots\">\n";
  body += BarPlot(axis, share, {.title = "Vertices by the share of frames that observe them", .unit = "%"});
  body += PlotOf(evaluation, {.title = "Measured by two cameras only, share of the cells", .unit = "%"},
                 [](const EvaluatedFrame& frame) { return ValueOr(frame.metrics.two_view_share); });
  body +=
      PlotOf(evaluation, {.title = "Coverage: observed share of the cells", .unit = "%", .from_zero = false},
             [](const EvaluatedFrame& frame) { return ValueOr(frame.metrics.coverage); });
  return Section(
      "visibility", "Visibility",
      body +
          "</div>\n<p>The paper reports 54 % to 90 % coverage per frame, 75 % in the mean (Fig. 7).</p>\n");
}

std::string FramePlotSection(const JobEvaluation& evaluation) {
  std::string body;
  const auto plot = [&](const std::string& title, const char* unit, int decimals, const FrameValue& value) {
    body += PlotOf(evaluation, {.title = title, .unit = unit, .decimals = decimals}, value);
  };
  const auto drift = [&](const char* title, const Drift& of) {
    plot(absl::StrCat(title, ", mean, ", DriftUnit(evaluation)), DriftUnit(evaluation),
         evaluation.fps > 0 ? 2 : 3, MeanOfMetric(FieldOf(evaluation, of)));
  };
  plot("Vertex error, seen by 3 or more, mean, mm", "mm", 3, MeanOfMesh(&MeshScore::visible_mm));
  plot("Vertex error, seen by fewer, mean, mm", "mm", 3, MeanOfMesh(&MeshScore::hidden_mm));
  drift("Drift by texture flow", kTextureDrift);
  drift("Exact drift, observed", kObservedDrift);
  drift("Exact drift, inferred", kInferredDrift);
  plot("Geodesic distortion, mm", "mm", 2,
       [](const EvaluatedFrame& frame) { return ValueOr(frame.metrics.distortion_mm); });
  plot("Self-intersecting pairs of faces", "", 0, Pairs);
  plot("Jitter, observed, mm", "mm", 3, MeanOfMetric(&FrameMetrics::jitter_observed_mm));
  plot("Jitter, inferred, mm", "mm", 3, MeanOfMetric(&FrameMetrics::jitter_inferred_mm));
  plot("Jitter of the error, observed, mm", "mm", 3, MeanOfMetric(&FrameMetrics::error_jitter_observed_mm));
  plot("Jitter of the error, inferred, mm", "mm", 3, MeanOfMetric(&FrameMetrics::error_jitter_inferred_mm));
  plot("Left-out camera error, px", "px", 3, MeanOfMetric(&FrameMetrics::left_out_px));
  if (body.empty()) return "";
  return Section("accuracy", "Accuracy over the frames",
                 absl::StrCat("<div class=\"plots\">\n", body, "</div>\n"));
}

std::string FrameTableSection(const JobEvaluation& evaluation) {
  std::string rows;
  const std::string unit = absl::StrCat(", ", DriftUnit(evaluation));
  const int decimals = evaluation.fps > 0 ? 2 : 3;
  const auto row = [&](const std::string& name, const FrameScore& score, const FrameMetrics& m) {
    const auto drift = [&](const Drift& of) {
      return FormatNumber(MeanOr(m.*FieldOf(evaluation, of)), decimals);
    };
    const auto mesh = [&](ErrorTally MeshScore::*kind) {
      return score.mesh ? MeanOr(Summarize((*score.mesh).*kind)) : kNone;
    };
    const auto cloud = score.cloud ? Summarize(score.cloud->errors_mm) : std::nullopt;
    return TableRow(
        "td", {name, m.coverage ? FormatPercent(*m.coverage) : kDash,
               score.centers && score.centers->Recall() ? FormatPercent(*score.centers->Recall()) : kDash,
               FormatNumber(cloud ? cloud->median : kNone, 3), FormatNumber(mesh(&MeshScore::visible_mm), 3),
               FormatNumber(mesh(&MeshScore::hidden_mm), 3), drift(kTextureDrift), drift(kObservedDrift),
               FormatNumber(ValueOr(m.distortion_mm), 2),
               m.self_intersections ? FormatCount(*m.self_intersections) : kDash,
               FormatNumber(MeanOr(m.jitter_observed_mm), 3), FormatNumber(MeanOr(m.left_out_px), 3)});
  };
  rows += row("<b>all</b>", evaluation.total, evaluation.total_metrics);
  for (const EvaluatedFrame& frame : evaluation.frames)
    rows += row(NameHtml(frame.frame), frame.score, frame.metrics);
  return Section("frame-measures", "Measures of the frames",
                 Table({"Frame", "Coverage", "Decode recall", "Cloud, median mm", "Seen by 3+, mm",
                        "By fewer, mm", "Texture drift" + unit, "Exact drift" + unit, "Distortion, mm",
                        "Self-inter&shy;sections", "Jitter, mm", "Left out, px"},
                       rows, "cameras"));
}

std::string CameraTableSection(const JobEvaluation& evaluation) {
  if (evaluation.cameras.empty()) return "";
  std::string rows;
  for (const CameraErrors& camera : evaluation.cameras) {
    const auto reprojection = Summarize(camera.reprojection_px), left_out = Summarize(camera.left_out_px);
    const auto shift = [&](int axis) {
      return left_out ? camera.shift_sum_px[axis] / static_cast<double>(left_out->count) : kNone;
    };
    const double outliers = camera.observations > 0 ? static_cast<double>(camera.outliers) /
                                                          static_cast<double>(camera.observations)
                                                    : kNone;
    rows += TableRow("td", {NameHtml(camera.camera_id), FormatCount(camera.observations),
                            std::isfinite(outliers) ? FormatPercent(outliers) : kDash,
                            FormatNumber(reprojection ? reprojection->median : kNone, 3),
                            FormatNumber(reprojection ? reprojection->p95 : kNone, 3),
                            FormatNumber(left_out ? left_out->median : kNone, 3),
                            FormatNumber(left_out ? left_out->p95 : kNone, 3), FormatNumber(shift(0), 3),
                            FormatNumber(shift(1), 3)});
  }
  return Section(
      "camera-errors", "Errors of the cameras",
      Table({"Camera", "Observations", "Outliers", "Reprojection, median px", "95 %", "Left out, median px",
             "95 %", "Shift x, px", "Shift y, px"},
            rows, "cameras") +
          "<p>Left out: distance to the point of all other cameras that agree with it. A shift that is not "
          "near zero indicates a camera that has moved since its calibration.</p>\n");
}

std::string RemarkSection(const JobEvaluation& evaluation) {
  if (evaluation.remarks.empty()) return "";
  std::string rows;
  for (const EvaluationRemark& remark : evaluation.remarks)
    rows += TableRow("td", {EscapeHtml(remark.metric), EscapeHtml(remark.reason)});
  return Section("remarks", "Not measured, and assumptions", Table({}, rows, "facts"));
}

}  // namespace weft
