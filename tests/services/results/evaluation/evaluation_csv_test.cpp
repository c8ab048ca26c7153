#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "services/results/evaluation/evaluation_text.h"
#include "tests/services/results/evaluation/sample_evaluation.h"

namespace weft {
namespace {

TEST(EvaluationCsv, FramesWithoutMeasuresHaveEmptyFields) {
  JobEvaluation evaluation;
  const std::string heading = FrameCsv(evaluation);
  evaluation.frames.emplace_back().frame = "frame \"7\"";
  const auto columns = static_cast<size_t>(std::count(heading.begin(), heading.end(), ','));
  EXPECT_GT(columns, 8u);
  EXPECT_EQ(FrameCsv(evaluation), heading + "\"frame \"\"7\"\"\"" + std::string(columns, ',') + "\n");
}

TEST(EvaluationCsv, CamerasWithoutErrorsKeepTheirCounts) {
  JobEvaluation evaluation;
  CameraErrors& camera = evaluation.cameras.emplace_back();
  camera.camera_id = "c01";
  camera.observations = 10, camera.outliers = 3;
  EXPECT_THAT(CameraCsv(evaluation), ::testing::EndsWith("\nc01,10,3,,,,,,\n"));
}

TEST(EvaluationCsv, FramesAndCamerasHaveTheirNumbersInTheirColumns) {
  JobEvaluation evaluation = SampleEvaluation();
  evaluation.frames.pop_back();
  EXPECT_EQ(OnItsSide(FrameCsv(evaluation)), R"(frame 0001
coverage 0.8125
two_view_share 0.125
decode_precision 0.99
decode_recall 0.8
decode_median_px 0.25
cloud_coverage 0.8
cloud_median_mm 0.625
mesh_visible_mean_mm 4
mesh_hidden_mean_mm 4
texture_drift_mm_s 2.001
texture_flow_lost 0.0625
true_drift_observed_mm_s 5.001
true_drift_inferred_mm_s 6.001
geodesic_distortion_mm 1.25
geodesic_distortion_relative 0.015
self_intersecting_pairs 1234
jitter_observed_mm 7.001
jitter_inferred_mm 8.001
jitter_of_truth_mm 9.001
error_jitter_observed_mm 10.001
error_jitter_inferred_mm 11.001
reprojection_px 14.001
left_out_px 15.001
texture_drift_mm 1.001
true_drift_observed_mm 3.001
true_drift_inferred_mm 4.001
error_change_mm 12.001
error_change_mm_s 13.001
)");
  EXPECT_EQ(OnItsSide(CameraCsv(evaluation)), R"(camera c01 c02
observations 40 2
outliers 3 0
reprojection_median_px 0.375 -
reprojection_p95_px 0.4875 -
left_out_median_px 1 -
left_out_p95_px 1.225 -
shift_x_px 0.125 -
shift_y_px -0.125 -
)");
}

}  // namespace
}  // namespace weft
