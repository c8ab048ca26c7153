// An evaluation as comma-separated values.
#include <optional>

#include "absl/strings/str_cat.h"
#include "services/results/evaluation/csv_text.h"
#include "services/results/evaluation/evaluation_measures.h"
#include "services/results/evaluation/evaluation_text.h"

namespace weft {
namespace {

using Value = std::optional<double>;

Value Field(const std::optional<ErrorSummary>& errors, double ErrorSummary::*field) {
  if (!errors) return std::nullopt;
  return (*errors).*field;
}

}  // namespace

std::string FrameCsv(const JobEvaluation& evaluation) {
  std::string csv = "frame";
  for (const EvaluationMeasure& measure : EvaluationMeasures()) absl::StrAppend(&csv, ",", measure.name);
  csv += '\n';
  for (const EvaluatedFrame& frame : evaluation.frames) {
    csv += CsvName(frame.frame);
    for (const EvaluationMeasure& measure : EvaluationMeasures()) AppendCsvNumber(measure.value(frame), csv);
    csv += '\n';
  }
  return csv;
}

std::string CameraCsv(const JobEvaluation& evaluation) {
  std::string csv =
      "camera,observations,outliers,reprojection_median_px,reprojection_p95_px,left_out_median_px,left_out_"
      "p95_px,shift_x_px,shift_y_px\n";
  for (const CameraErrors& camera : evaluation.cameras) {
    absl::StrAppend(&csv, CsvName(camera.camera_id), ",", camera.observations, ",", camera.outliers);
    const auto reprojection = Summarize(camera.reprojection_px), left_out = Summarize(camera.left_out_px);
    for (const auto& errors : {reprojection, left_out})
      for (const auto field : {&ErrorSummary::median, &ErrorSummary::p95})
        AppendCsvNumber(Field(errors, field), csv);
    for (const int axis : {0, 1})
      AppendCsvNumber(
          left_out ? Value(camera.shift_sum_px[axis] / static_cast<double>(left_out->count)) : Value(), csv);
    csv += '\n';
  }
  return csv;
}

}  // namespace weft
