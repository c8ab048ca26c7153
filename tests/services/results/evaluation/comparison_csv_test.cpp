#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/results/evaluation/comparison_text.h"
#include "tests/services/results/evaluation/sample_comparison.h"

namespace weft {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

TEST(ComparisonCsv, VerticesHaveEmptyFieldsWhereNothingWasMeasured) {
  JobComparison comparison;
  EXPECT_EQ(ComparedVertexCsv(comparison), "");
  comparison.maps.distance_mm = {1.5, std::nan("")};
  comparison.maps.a_minus_b.error_mm = {-2};
  EXPECT_THAT(ComparedVertexCsv(comparison), EndsWith("\n0,1.5,,,-2,,,\n1,,,,,,,\n"));
}

TEST(ComparisonCsv, CamerasOfEitherRigHaveALine) {
  JobComparison comparison;
  comparison.a.cameras.emplace_back().camera_id = "only a";
  comparison.b.cameras.emplace_back().camera_id = "b,2";
  const std::string csv = ComparedCameraCsv(comparison);
  EXPECT_THAT(csv, HasSubstr("\n\"b,2\",,,,,,0,,,,\n"));
  EXPECT_THAT(csv, HasSubstr("\nonly a,0,,,,,,,,,\n"));
}

TEST(ComparisonCsv, MeasuresThatWereNotTestedHaveNoProbability) {
  JobComparison comparison;
  ComparedMeasure& compared = comparison.measures.emplace_back();
  compared.measure = &EvaluationMeasures().front();
  compared.frames = 3, compared.a = 0.75, compared.b = 0.5;
  EXPECT_THAT(ComparisonCsv(comparison), HasSubstr(",3,0.75,0.5,0.25,,,,,not tested\n"));
}

TEST(ComparisonCsv, LinesOfFramesHaveTheColumnsOfTheirHeading) {
  JobComparison comparison;
  comparison.a.frames.emplace_back().frame = "7";
  comparison.b.frames.emplace_back().frame = "7";
  comparison.frames.emplace_back().beyond_sigmas_share = 0.25;
  const std::string csv = ComparedFrameCsv(comparison);
  const size_t heading = csv.find('\n') + 1;
  EXPECT_EQ(std::count(csv.begin(), csv.begin() + static_cast<std::ptrdiff_t>(heading), ','),
            std::count(csv.begin() + static_cast<std::ptrdiff_t>(heading), csv.end(), ','));
  EXPECT_THAT(csv, EndsWith(",0.25\n"));
}

TEST(ComparisonCsv, NumbersStandInTheirColumns) {
  const JobComparison comparison = SampleComparison();
  EXPECT_EQ(OnItsSide(ComparisonCsv(comparison)), R"(measure coverage jitter_observed_mm
unit % mm
frames 9 3
a 0.75 1.5
b 0.25 2
difference 0.5 -0.5
standard_error 0.0625 -
degrees_of_freedom 6 -
p 0.0125 -
p_adjusted 0.025 -
outcome A is better not tested
)");
  EXPECT_EQ(OnItsSide(ComparedCameraCsv(comparison)), R"(camera c01 c02
observations_a 40 -
reprojection_median_px_a 0.375 -
left_out_median_px_a 1 -
shift_x_px_a 0.125 -
shift_y_px_a -0.125 -
observations_b 40 40
reprojection_median_px_b 0.75 1.5
left_out_median_px_b 2 4
shift_x_px_b 0.25 0.5
shift_y_px_b -0.25 -0.5
)");
  EXPECT_EQ(OnItsSide(ComparedVertexCsv(comparison)), R"(vertex 0 1
distance_mm 1 2
distance_sigmas 3 4
visibility_difference 0.5 0.25
error_difference_mm 5 6
distortion_difference_mm 7 8
texture_drift_difference 9 10
exact_drift_difference 11 12
)");
  EXPECT_EQ(OnItsSide(ComparedFrameCsv(comparison)), R"(frame 0001 0002
coverage_a 0.8125 -
coverage_b 0.25 -
two_view_share_a 0.125 -
two_view_share_b 0.125 -
decode_precision_a 0.99 -
decode_precision_b 0.99 -
decode_recall_a 0.8 -
decode_recall_b 0.8 -
decode_median_px_a 0.25 -
decode_median_px_b 0.25 -
cloud_coverage_a 0.8 -
cloud_coverage_b 0.8 -
cloud_median_mm_a 0.625 -
cloud_median_mm_b 0.625 -
mesh_visible_mean_mm_a 4 -
mesh_visible_mean_mm_b 4 -
mesh_hidden_mean_mm_a 4 -
mesh_hidden_mean_mm_b 4 -
texture_drift_mm_s_a 2.001 -
texture_drift_mm_s_b 2.001 -
texture_flow_lost_a 0.0625 -
texture_flow_lost_b 0.0625 -
true_drift_observed_mm_s_a 5.001 -
true_drift_observed_mm_s_b 5.001 -
true_drift_inferred_mm_s_a 6.001 -
true_drift_inferred_mm_s_b 6.001 -
geodesic_distortion_mm_a 1.25 -
geodesic_distortion_mm_b 1.25 -
geodesic_distortion_relative_a 0.015 -
geodesic_distortion_relative_b 0.015 -
self_intersecting_pairs_a 1234 -
self_intersecting_pairs_b 1234 -
jitter_observed_mm_a 7.001 -
jitter_observed_mm_b 7.001 -
jitter_inferred_mm_a 8.001 -
jitter_inferred_mm_b 8.001 -
jitter_of_truth_mm_a 9.001 -
jitter_of_truth_mm_b 9.001 -
error_jitter_observed_mm_a 10.001 -
error_jitter_observed_mm_b 10.001 -
error_jitter_inferred_mm_a 11.001 -
error_jitter_inferred_mm_b 11.001 -
reprojection_px_a 14.001 -
reprojection_px_b 14.001 -
left_out_px_a 15.001 -
left_out_px_b 15.001 -
texture_drift_mm_a 1.001 -
texture_drift_mm_b 1.001 -
true_drift_observed_mm_a 3.001 -
true_drift_observed_mm_b 3.001 -
true_drift_inferred_mm_a 4.001 -
true_drift_inferred_mm_b 4.001 -
error_change_mm_a 12.001 -
error_change_mm_b 12.001 -
error_change_mm_s_a 13.001 -
error_change_mm_s_b 13.001 -
distance_mean_mm 0.501 -
distance_median_mm 0.502 -
distance_p95_mm 0.503 -
distance_max_mm 0.504 -
beyond_sigmas_share 0.125 -
)");
}

}  // namespace
}  // namespace weft
