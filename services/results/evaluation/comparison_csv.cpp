// A comparison as comma-separated values.
#include <map>
#include <optional>

#include "absl/strings/str_cat.h"
#include "services/results/evaluation/comparison_text.h"
#include "services/results/evaluation/csv_text.h"

namespace weft {
namespace {

std::optional<double> AtVertex(const std::vector<double>& values, size_t vertex) {
  if (vertex >= values.size()) return std::nullopt;
  return values[vertex];
}

// Medians of a camera's errors and its mean shift; five fields.
void AppendCamera(const CameraErrors* camera, std::string& csv) {
  if (camera == nullptr) {
    csv += ",,,,,";
    return;
  }
  absl::StrAppend(&csv, ",", camera->observations);
  const auto reprojection = Summarize(camera->reprojection_px), left_out = Summarize(camera->left_out_px);
  AppendCsvNumber(reprojection ? std::optional(reprojection->median) : std::nullopt, csv);
  AppendCsvNumber(left_out ? std::optional(left_out->median) : std::nullopt, csv);
  for (const int axis : {0, 1})
    AppendCsvNumber(left_out
                        ? std::optional(camera->shift_sum_px[axis] / static_cast<double>(left_out->count))
                        : std::nullopt,
                    csv);
}

}  // namespace

std::string ComparisonCsv(const JobComparison& comparison) {
  std::string csv =
      "measure,unit,frames,a,b,difference,standard_error,degrees_of_freedom,p,p_adjusted,outcome\n";
  for (const ComparedMeasure& compared : comparison.measures) {
    absl::StrAppend(&csv, compared.measure->name, ",", compared.measure->unit, ",", compared.frames);
    for (const double value : {compared.a, compared.b, compared.a - compared.b}) AppendCsvNumber(value, csv);
    if (compared.test) {
      AppendCsvNumber(compared.test->standard_error, csv);
      AppendCsvNumber(compared.test->degrees_of_freedom, csv);
      AppendCsvNumber(compared.test->p, csv);
      AppendCsvNumber(compared.p_adjusted, csv);
    } else {
      csv += ",,,,";
    }
    absl::StrAppend(&csv, ",", OutcomeText(compared.outcome), "\n");
  }
  return csv;
}

std::string ComparedFrameCsv(const JobComparison& comparison) {
  std::string csv = "frame";
  for (const EvaluationMeasure& measure : EvaluationMeasures())
    absl::StrAppend(&csv, ",", measure.name, "_a,", measure.name, "_b");
  csv += ",distance_mean_mm,distance_median_mm,distance_p95_mm,distance_max_mm,beyond_sigmas_share\n";
  for (size_t f = 0; f < comparison.frames.size(); ++f) {
    csv += CsvName(comparison.a.frames[f].frame);
    for (const EvaluationMeasure& measure : EvaluationMeasures()) {
      AppendCsvNumber(measure.value(comparison.a.frames[f]), csv);
      AppendCsvNumber(measure.value(comparison.b.frames[f]), csv);
    }
    const FrameDifference& difference = comparison.frames[f];
    for (const auto field :
         {&ErrorSummary::mean, &ErrorSummary::median, &ErrorSummary::p95, &ErrorSummary::max})
      AppendCsvNumber(difference.distance_mm ? std::optional((*difference.distance_mm).*field) : std::nullopt,
                      csv);
    AppendCsvNumber(difference.beyond_sigmas_share, csv);
    csv += '\n';
  }
  return csv;
}

std::string ComparedCameraCsv(const JobComparison& comparison) {
  struct Sides {
    const CameraErrors *a = nullptr, *b = nullptr;
  };
  std::map<std::string, Sides> cameras;
  for (const CameraErrors& camera : comparison.a.cameras) cameras[camera.camera_id].a = &camera;
  for (const CameraErrors& camera : comparison.b.cameras) cameras[camera.camera_id].b = &camera;
  std::string csv = "camera";
  for (const char* side : {"a", "b"})
    for (const char* column :
         {"observations", "reprojection_median_px", "left_out_median_px", "shift_x_px", "shift_y_px"})
      absl::StrAppend(&csv, ",", column, "_", side);
  csv += '\n';
  for (const auto& [name, sides] : cameras) {
    csv += CsvName(name);
    AppendCamera(sides.a, csv);
    AppendCamera(sides.b, csv);
    csv += '\n';
  }
  return csv;
}

std::string ComparedVertexCsv(const JobComparison& comparison) {
  const DifferenceMaps& maps = comparison.maps;
  if (maps.distance_mm.empty()) return "";
  std::string csv =
      "vertex,distance_mm,distance_sigmas,visibility_difference,error_difference_mm,distortion_difference_mm,"
      "texture_drift_difference,exact_drift_difference\n";
  for (size_t v = 0; v < maps.distance_mm.size(); ++v) {
    absl::StrAppend(&csv, v);
    for (const std::vector<double>* values :
         {&maps.distance_mm, &maps.distance_sigmas, &maps.a_minus_b.visibility, &maps.a_minus_b.error_mm,
          &maps.a_minus_b.distortion_mm, &maps.a_minus_b.texture_drift, &maps.a_minus_b.true_drift})
      AppendCsvNumber(AtVertex(*values, v), csv);
    csv += '\n';
  }
  return csv;
}

}  // namespace weft
