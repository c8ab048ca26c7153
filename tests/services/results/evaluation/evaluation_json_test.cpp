#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/formats/files/json_file.h"
#include "services/results/evaluation/evaluation_text.h"
#include "tests/services/results/evaluation/sample_evaluation.h"
#include "tests/services/results/report/proto_text.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

TEST(EvaluationJson, EveryFieldIsThatOfTheEvaluation) {
  JobEvaluation evaluation = SampleEvaluation();
  evaluation.verdict.set_reason("as it should be");
  v1::Evaluation message = EvaluationMessage(evaluation);
  EXPECT_EQ(message.paper_size(), 4);
  message.clear_paper();
  EXPECT_EQ(message.total().DebugString(), TextOf<v1::FrameScore>(
                                               R"(frame: "total"
               centers {
                 observations: 1000
                 right: 990
                 scoreable: 1100
                 found: 880
                 precision: 0.99
                 recall: 0.8
                 error_px { count: 3 mean: 0.25 median: 0.25 p95: 0.3625 max: 0.375 p99: 0.3725 }
                 by_pitch { least_px: 4 scoreable: 300 found: 210 recall: 0.7 }
                 by_pitch { least_px: 10 scoreable: 800 found: 670 recall: 0.8375 }
                 out_of_sight: 4
                 wrong_px { count: 2 mean: 3 median: 3 p95: 3.9 max: 4 p99: 3.98 }
               }
               corners {
                 observations: 500
                 right: 480
                 scoreable: 600
                 found: 450
                 precision: 0.96
                 recall: 0.75
                 error_px { count: 1 mean: 0.5 median: 0.5 p95: 0.5 max: 0.5 p99: 0.5 }
               }
               cloud {
                 points: 2000
                 points_of_unseen_cells: 7
                 well_seen_vertices: 1500
                 covered_vertices: 1200
                 coverage: 0.8
                 error_mm { count: 2 mean: 0.625 median: 0.625 p95: 0.7375 max: 0.75 p99: 0.7475 }
               }
               mesh {
                 visible_mm { count: 3 mean: 4 median: 2 p95: 8.2999999999999989 max: 9 p99: 8.86 }
                 hidden_mm { count: 2 mean: 4 median: 4 p95: 4.9 max: 5 p99: 4.98 }
                 visible_far_share: 0.33333333333333331
                 with_point_mm { count: 2 mean: 2 median: 2 p95: 2.9 max: 3 p99: 2.98 }
                 point_mm { count: 2 mean: 0.5 median: 0.5 p95: 0.725 max: 0.75 p99: 0.745 }
               }
               measures {
                 coverage: 0.8125
                 geodesic_distortion_mm: 1.25
                 geodesic_distortion_relative: 0.015
                 self_intersecting_pairs: 1234
                 texture_drift_mm_s { count: 10 mean: 2.001 median: 2.002 p95: 2.003 max: 2.004 p99: 2.005 }
                 texture_flow_lost: 0.0625
                 true_drift_observed_mm_s {
                   count: 10
                   mean: 5.001
                   median: 5.002
                   p95: 5.003
                   max: 5.004
                   p99: 5.005
                 }
                 true_drift_inferred_mm_s {
                   count: 10
                   mean: 6.001
                   median: 6.002
                   p95: 6.003
                   max: 6.004
                   p99: 6.005
                 }
                 jitter_observed_mm { count: 10 mean: 7.001 median: 7.002 p95: 7.003 max: 7.004 p99: 7.005 }
                 jitter_inferred_mm { count: 10 mean: 8.001 median: 8.002 p95: 8.003 max: 8.004 p99: 8.005 }
                 jitter_of_truth_mm { count: 10 mean: 9.001 median: 9.002 p95: 9.003 max: 9.004 p99: 9.005 }
                 reprojection_px { count: 10 mean: 14.001 median: 14.002 p95: 14.003 max: 14.004 p99: 14.005 }
                 left_out_px { count: 10 mean: 15.001 median: 15.002 p95: 15.003 max: 15.004 p99: 15.005 }
                 error_jitter_observed_mm {
                   count: 10
                   mean: 10.001
                   median: 10.002
                   p95: 10.003
                   max: 10.004
                   p99: 10.005
                 }
                 error_jitter_inferred_mm {
                   count: 10
                   mean: 11.001
                   median: 11.002
                   p95: 11.003
                   max: 11.004
                   p99: 11.005
                 }
                 two_view_share: 0.125
                 texture_drift_mm { count: 10 mean: 1.001 median: 1.002 p95: 1.003 max: 1.004 p99: 1.005 }
                 true_drift_observed_mm {
                   count: 10
                   mean: 3.001
                   median: 3.002
                   p95: 3.003
                   max: 3.004
                   p99: 3.005
                 }
                 true_drift_inferred_mm {
                   count: 10
                   mean: 4.001
                   median: 4.002
                   p95: 4.003
                   max: 4.004
                   p99: 4.005
                 }
                 error_change_mm { count: 10 mean: 12.001 median: 12.002 p95: 12.003 max: 12.004 p99: 12.005 }
                 error_change_mm_s {
                   count: 10
                   mean: 13.001
                   median: 13.002
                   p95: 13.003
                   max: 13.004
                   p99: 13.005
                 }
               })"));
  EXPECT_EQ(message.frames_size(), 2);
  v1::FrameScore first = message.frames(0);
  EXPECT_EQ(first.frame(), "0001");
  first.set_frame("total");
  EXPECT_EQ(first.DebugString(), message.total().DebugString());
  EXPECT_EQ(message.frames(1).DebugString(), TextOf<v1::FrameScore>(R"(frame: "0002"
 missing: "observations.csv"
 missing: "cloud.ply"
 missing: "mesh.ply"
 measures {})"));
  message.clear_total(), message.clear_frames();
  EXPECT_EQ(message.DebugString(), TextOf<v1::Evaluation>(
                                       R"(cameras {
 camera: "c01"
 observations: 40
 outliers: 3
 reprojection_px { count: 2 mean: 0.375 median: 0.375 p95: 0.4875 max: 0.5 p99: 0.4975 }
 left_out_px { count: 2 mean: 1 median: 1 p95: 1.225 max: 1.25 p99: 1.245 }
 shift_x_px: 0.125
 shift_y_px: -0.125
 }
 cameras { camera: "c02" observations: 2 }
 remarks { measure: "texture drift" reason: "there are no pictures" }
 visibility_histogram: 2
 visibility_histogram: 1
 visibility_histogram: 0
 visibility_histogram: 0
 visibility_histogram: 0
 visibility_histogram: 0
 visibility_histogram: 0
 visibility_histogram: 0
 visibility_histogram: 0
 visibility_histogram: 2
 result: "/result"
 truth: "/take/truth"
 dump: "/take"
 frames_per_s: 25
 verdict { reason: "as it should be" }
 frames_per_s_source: "--fps"
 job_id: "j-7")"));
  v1::Evaluation read;
  ASSERT_TRUE(ParseJson(*ToJson(EvaluationMessage(evaluation)), "json", read).ok());
  EXPECT_EQ(read.DebugString(), EvaluationMessage(evaluation).DebugString());
}

TEST(EvaluationJson, VerticesThatNoFrameKnowsAreNotInTheHistogram) {
  EXPECT_THAT(VisibilityHistogram({std::nan(""), 0.35, 0.5, 0.59, 1}),
              ElementsAre(0, 0, 0, 1, 0, 2, 0, 0, 0, 1));
  EXPECT_EQ(EvaluationMessage({}).visibility_histogram_size(), 0);
}

TEST(EvaluationJson, CountsBeyond32BitsAreTheLargest) {
  ErrorSummary summary;
  summary.count = int64_t{1} << 40;
  EXPECT_EQ(ErrorSummaryMessage(summary).count(), std::numeric_limits<uint32_t>::max());
}

}  // namespace
}  // namespace weft
