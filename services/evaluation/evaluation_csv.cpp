// An evaluation as comma-separated values.
#include <functional>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/evaluation/evaluation_text.h"

namespace weft {
namespace {

using Value = std::optional<double>;

Value Field(const std::optional<ErrorSummary>& errors, double ErrorSummary::*field) {
  if (!errors) return std::nullopt;
  return (*errors).*field;
}

struct Column {
  const char* name;
  std::function<Value(const EvaluatedFrame&)> value;
};

// Mean, or median, of the frame's summary.
Column MeanColumn(const char* name, std::optional<ErrorSummary> FrameMetrics::*field) {
  return {name, [field](const EvaluatedFrame& f) { return Field(f.metrics.*field, &ErrorSummary::mean); }};
}

std::vector<Column> FrameColumns() {
  using Frame = const EvaluatedFrame&;
  return {
      {"coverage", [](Frame f) { return f.metrics.coverage; }},
      {"two_view_share", [](Frame f) { return f.metrics.two_view_share; }},
      {"decode_precision", [](Frame f) { return f.score.centers ? f.score.centers->Precision() : Value(); }},
      {"decode_recall", [](Frame f) { return f.score.centers ? f.score.centers->Recall() : Value(); }},
      {"decode_median_px",
       [](Frame f) {
         return f.score.centers ? Field(Summarize(f.score.centers->errors_px), &ErrorSummary::median)
                                : Value();
       }},
      {"cloud_coverage", [](Frame f) { return f.score.cloud ? f.score.cloud->Coverage() : Value(); }},
      {"cloud_median_mm",
       [](Frame f) {
         return f.score.cloud ? Field(Summarize(f.score.cloud->errors_mm), &ErrorSummary::median) : Value();
       }},
      {"mesh_visible_mean_mm",
       [](Frame f) {
         return f.score.mesh ? Field(Summarize(f.score.mesh->visible_mm), &ErrorSummary::mean) : Value();
       }},
      {"mesh_hidden_mean_mm",
       [](Frame f) {
         return f.score.mesh ? Field(Summarize(f.score.mesh->hidden_mm), &ErrorSummary::mean) : Value();
       }},
      MeanColumn("texture_drift_mm_s", &FrameMetrics::texture_drift_mm_s),
      {"texture_flow_lost", [](Frame f) { return f.metrics.texture_flow_lost; }},
      MeanColumn("true_drift_observed_mm_s", &FrameMetrics::true_drift_observed_mm_s),
      MeanColumn("true_drift_inferred_mm_s", &FrameMetrics::true_drift_inferred_mm_s),
      {"geodesic_distortion_mm", [](Frame f) { return f.metrics.distortion_mm; }},
      {"geodesic_distortion_relative", [](Frame f) { return f.metrics.distortion_relative; }},
      {"self_intersecting_pairs",
       [](Frame f) {
         return f.metrics.self_intersections ? Value(static_cast<double>(*f.metrics.self_intersections))
                                             : Value();
       }},
      MeanColumn("jitter_observed_mm", &FrameMetrics::jitter_observed_mm),
      MeanColumn("jitter_inferred_mm", &FrameMetrics::jitter_inferred_mm),
      MeanColumn("jitter_of_truth_mm", &FrameMetrics::jitter_of_truth_mm),
      MeanColumn("error_jitter_observed_mm", &FrameMetrics::error_jitter_observed_mm),
      MeanColumn("error_jitter_inferred_mm", &FrameMetrics::error_jitter_inferred_mm),
      MeanColumn("reprojection_px", &FrameMetrics::reprojection_px),
      MeanColumn("left_out_px", &FrameMetrics::left_out_px),
      MeanColumn("texture_drift_mm", &FrameMetrics::texture_drift_mm),
      MeanColumn("true_drift_observed_mm", &FrameMetrics::true_drift_observed_mm),
      MeanColumn("true_drift_inferred_mm", &FrameMetrics::true_drift_inferred_mm),
      MeanColumn("error_change_mm", &FrameMetrics::error_change_mm),
      MeanColumn("error_change_mm_s", &FrameMetrics::error_change_mm_s)};
}

// Quoted where a name would break the line.
std::string Text(const std::string& name) {
  if (name.find_first_of(",\"\r\n") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

void AppendNumber(const Value& value, std::string& csv) {
  csv += ',';
  if (value) absl::StrAppendFormat(&csv, "%.6g", *value);
}

}  // namespace

std::string FrameCsv(const JobEvaluation& evaluation) {
  const std::vector<Column> columns = FrameColumns();
  std::string csv = "frame";
  for (const Column& column : columns) absl::StrAppend(&csv, ",", column.name);
  csv += '\n';
  for (const EvaluatedFrame& frame : evaluation.frames) {
    csv += Text(frame.frame);
    for (const Column& column : columns) AppendNumber(column.value(frame), csv);
    csv += '\n';
  }
  return csv;
}

std::string CameraCsv(const JobEvaluation& evaluation) {
  std::string csv =
      "camera,observations,outliers,reprojection_median_px,reprojection_p95_px,left_out_median_px,left_out_"
      "p95_px,shift_x_px,shift_y_px\n";
  for (const CameraErrors& camera : evaluation.cameras) {
    absl::StrAppend(&csv, Text(camera.camera_id), ",", camera.observations, ",", camera.outliers);
    const auto reprojection = Summarize(camera.reprojection_px), left_out = Summarize(camera.left_out_px);
    for (const auto& errors : {reprojection, left_out})
      for (const auto field : {&ErrorSummary::median, &ErrorSummary::p95})
        AppendNumber(Field(errors, field), csv);
    for (const int axis : {0, 1})
      AppendNumber(
          left_out ? Value(camera.shift_sum_px[axis] / static_cast<double>(left_out->count)) : Value(), csv);
    csv += '\n';
  }
  return csv;
}

}  // namespace weft
