// An evaluation as weft.v1.Evaluation.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <variant>

#include "services/results/evaluation/evaluation_measures.h"
#include "services/results/evaluation/evaluation_text.h"
#include "services/results/report/paper_table.h"
#include "weft/v1/evaluation.pb.h"

namespace weft {
namespace {

// JSON writes 64-bit numbers as strings, so counts are 32 bits wide there.
uint32_t Count(int64_t count) {
  return static_cast<uint32_t>(std::min<int64_t>(count, std::numeric_limits<uint32_t>::max()));
}

v1::ErrorSummary ToProto(const ErrorSummary& summary) { return ErrorSummaryMessage(summary); }

std::optional<v1::ErrorSummary> ToProto(const ErrorTally& errors) {
  const std::optional<ErrorSummary> summary = Summarize(errors);
  if (!summary) return std::nullopt;
  return ToProto(*summary);
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
  out.set_out_of_sight(Count(score.out_of_sight));
  if (const auto wrong = ToProto(score.wrong_px)) *out.mutable_wrong_px() = *wrong;
  for (size_t k = 0; k < score.by_pitch.size(); ++k) {
    const auto& [scoreable, found] = score.by_pitch[k];
    if (scoreable == 0) continue;
    v1::DecodeScore::PitchClass& added = *out.add_by_pitch();
    added.set_least_px(DecodeScore::kPitchClassesPx[k]);
    added.set_scoreable(Count(scoreable));
    added.set_found(Count(found));
    added.set_recall(static_cast<double>(found) / static_cast<double>(scoreable));
  }
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

void SetField(double value, const google::protobuf::FieldDescriptor* field, v1::MeasureScore& to) {
  to.GetReflection()->SetDouble(&to, field, value);
}
void SetField(int64_t value, const google::protobuf::FieldDescriptor* field, v1::MeasureScore& to) {
  to.GetReflection()->SetUInt32(&to, field, Count(value));
}
void SetField(const ErrorSummary& value, const google::protobuf::FieldDescriptor* field,
              v1::MeasureScore& to) {
  to.GetReflection()->MutableMessage(&to, field)->CopyFrom(ToProto(value));
}

v1::MeasureScore ToProto(const FrameMetrics& metrics) {
  v1::MeasureScore out;
  for (const FrameMetric& metric : FrameMetricFields())
    std::visit(
        [&](auto field) {
          if (metrics.*field)
            SetField(*(metrics.*field), out.GetDescriptor()->FindFieldByName(metric.name), out);
        },
        metric.field);
  return out;
}

}  // namespace

v1::CameraScore CameraScoreMessage(const CameraErrors& errors) {
  v1::CameraScore out;
  out.set_camera(errors.camera_id);
  out.set_observations(Count(errors.observations));
  out.set_outliers(Count(errors.outliers));
  if (const auto px = ToProto(errors.reprojection_px)) *out.mutable_reprojection_px() = *px;
  const auto left_out = ToProto(errors.left_out_px);
  if (!left_out) return out;
  *out.mutable_left_out_px() = *left_out;
  out.set_shift_x_px(errors.shift_sum_px.x() / static_cast<double>(errors.left_out_px.size()));
  out.set_shift_y_px(errors.shift_sum_px.y() / static_cast<double>(errors.left_out_px.size()));
  return out;
}

namespace {

v1::FrameScore ToProto(const std::string& name, const std::vector<std::string>& missing,
                       const FrameScore& score, const FrameMetrics& metrics) {
  v1::FrameScore out;
  out.set_frame(name);
  for (const std::string& file : missing) out.add_missing(file);
  *out.mutable_measures() = ToProto(metrics);
  if (score.centers) *out.mutable_centers() = ToProto(*score.centers);
  if (score.corners) *out.mutable_corners() = ToProto(*score.corners);
  if (score.cloud) *out.mutable_cloud() = ToProto(*score.cloud);
  if (score.mesh) {
    v1::MeshScore& mesh = *out.mutable_mesh();
    if (const auto visible = ToProto(score.mesh->visible_mm)) *mesh.mutable_visible_mm() = *visible;
    if (const auto hidden = ToProto(score.mesh->hidden_mm)) *mesh.mutable_hidden_mm() = *hidden;
    if (const auto share = score.mesh->FarShare()) mesh.set_visible_far_share(*share);
    if (const auto errors = ToProto(score.mesh->with_point_mm)) *mesh.mutable_with_point_mm() = *errors;
    if (const auto errors = ToProto(score.mesh->point_mm)) *mesh.mutable_point_mm() = *errors;
  }
  return out;
}

}  // namespace

v1::ErrorSummary ErrorSummaryMessage(const ErrorSummary& summary) {
  v1::ErrorSummary out;
  out.set_count(Count(summary.count));
  out.set_mean(summary.mean);
  out.set_median(summary.median);
  out.set_p95(summary.p95);
  out.set_max(summary.max);
  out.set_p99(summary.p99);
  return out;
}

std::array<int, 10> VisibilityHistogram(const std::vector<double>& visibility) {
  std::array<int, 10> counts{};
  for (const double share : visibility)
    if (share >= 0) ++counts[std::min<size_t>(counts.size() - 1, static_cast<size_t>(share * 10))];
  return counts;
}

v1::Evaluation EvaluationMessage(const JobEvaluation& evaluation) {
  v1::Evaluation out;
  for (const EvaluatedFrame& frame : evaluation.frames)
    *out.add_frames() = ToProto(frame.frame, frame.missing, frame.score, frame.metrics);
  *out.mutable_total() = ToProto("total", {}, evaluation.total, evaluation.total_metrics);
  for (const CameraErrors& camera : evaluation.cameras) *out.add_cameras() = CameraScoreMessage(camera);
  for (const EvaluationRemark& remark : evaluation.remarks) {
    v1::EvaluationRemark& added = *out.add_remarks();
    added.set_measure(remark.metric);
    added.set_reason(remark.reason);
  }
  if (!evaluation.maps.visibility.empty())
    for (const int count : VisibilityHistogram(evaluation.maps.visibility))
      out.add_visibility_histogram(count);
  AddPaperTable(*out.mutable_paper());
  out.set_result(evaluation.result);
  out.set_truth(evaluation.truth);
  out.set_dump(evaluation.dump);
  out.set_job_id(evaluation.job_id);
  out.set_frames_per_s(evaluation.fps);
  out.set_frames_per_s_source(evaluation.fps_source);
  *out.mutable_verdict() = evaluation.verdict;
  return out;
}

}  // namespace weft
