#include "services/results/evaluation/evaluation_text.h"

#include <gtest/gtest.h>

#include "tests/services/results/evaluation/sample_evaluation.h"

namespace weft {
namespace {

TEST(EvaluationText, TheTableHasEveryScoreAndMeasure) {
  EXPECT_EQ(EvaluationTable(SampleEvaluation()),
            R"(         | decode, cell centres              | cloud, seen by 3 or more | mesh error in mm
frame    |  precis.   recall  med px  p95 px |  covered  med mm  p95 mm | visible     p95  hidden     p95
0001     |  99.00 %  80.00 %   0.250   0.362 |  80.00 %   0.625   0.738 |   4.000   8.300   4.000   4.900
0002     | no observations.csv               | no cloud.ply             | no mesh.ply
total    |  99.00 %  80.00 %   0.250   0.362 |  80.00 %   0.625   0.738 |   4.000   8.300   4.000   4.900

decode   990 of 1,000 observed cells are right, 880 of 1,100 scoreable ones found
         10 wrong ones: 4 of cells out of sight, the others off by 3.000 px in the median, 3.900 px at 95 %
         recall 70.00 % of 300 cells from 4 px to 5 px
         recall 83.75 % of 800 cells from 10 px on
corners  precision 96.00 %, recall 75.00 %, 0.500 px in the median, 0.500 px at 95 %
cloud    1,200 of 1,500 vertex positions seen by 3 cameras or more have a point; 2,000 points, 7 of cells that no camera sees
mesh     3 vertex positions seen by 3 cameras or more, 2 by fewer
         8.860 mm at 99 % where seen by 3 or more, 9.000 mm at most, 33.33 % beyond 5 mm
         2 of them have a point:
           vertices 2.000 mm in the median, 2.900 at 95 %, 2.980 at 99 %, 3.000 at most
           points   0.500 mm in the median, 0.725 at 95 %, 0.745 at 99 %, 0.750 at most
coverage 81.25 % of the cells seen by 3 cameras or more, 12.50 % by 2
geodesic 1.25 mm of distortion, 1.50 % of the distance
drift    2.001 mm/s by texture flow
drift    5.001 mm/s against the truth where observed, 6.001 mm/s where inferred
error    from frame to frame, seen by 3 or more: 13.002 mm/s in the median, 13.005 at 99 %
jitter   7.001 mm where observed, 8.001 mm where inferred
         10.001 mm of the error against the truth where observed, 11.001 mm where inferred
self-intersections: 1,234 pairs of faces in all frames
cameras  14.001 px reprojection error, 15.001 px with the camera left out
rate     25.00 frames/s, by --fps
note     texture drift: there are no pictures
)");
}

TEST(EvaluationText, WithoutATruthThereAreMeasuresAndNotes) {
  JobEvaluation evaluation = SampleEvaluation();
  evaluation.truth.clear();
  evaluation.fps = 0;
  FrameMetrics& m = evaluation.total_metrics;
  m.self_intersections = 0;
  m.two_view_share.reset(), m.distortion_relative.reset();
  m.texture_drift_mm_s.reset(), m.error_change_mm_s.reset();
  m.true_drift_observed_mm.reset(), m.true_drift_observed_mm_s.reset(), m.true_drift_inferred_mm_s.reset();
  m.jitter_inferred_mm.reset(), m.error_jitter_observed_mm.reset(), m.left_out_px.reset();
  EXPECT_EQ(EvaluationTable(evaluation), R"(coverage 81.25 % of the cells seen by 3 cameras or more, - by 2
geodesic 1.25 mm of distortion, 0.00 % of the distance
drift    1.001 mm a frame by texture flow
drift    - against the truth where observed, 4.001 mm a frame where inferred
error    from frame to frame, seen by 3 or more: 12.002 mm a frame in the median, 12.005 at 99 %
jitter   7.001 mm where observed, - mm where inferred
         - mm of the error against the truth where observed, 11.001 mm where inferred
self-intersections: none
cameras  14.001 px reprojection error, - px with the camera left out
note     texture drift: there are no pictures
)");
}

TEST(EvaluationText, WhatWasNotMeasuredHasNoLine) {
  EXPECT_EQ(EvaluationTable({}), "");
  JobEvaluation evaluation;
  evaluation.total_metrics.true_drift_observed_mm = ErrorsAbove(3);
  evaluation.total_metrics.error_jitter_observed_mm = ErrorsAbove(10);
  EXPECT_EQ(EvaluationTable(evaluation),
            R"(drift    3.001 mm a frame against the truth where observed, - where inferred
         10.001 mm of the error against the truth where observed, - mm where inferred
)");
}

TEST(EvaluationText, ScoresWithoutErrorsAreDashes) {
  JobEvaluation evaluation;
  evaluation.truth = "/truth";
  evaluation.total.centers.emplace(), evaluation.total.corners.emplace();
  evaluation.total.cloud.emplace(), evaluation.total.mesh.emplace();
  EXPECT_EQ(EvaluationTable(evaluation),
            R"(         | decode, cell centres              | cloud, seen by 3 or more | mesh error in mm
frame    |  precis.   recall  med px  p95 px |  covered  med mm  p95 mm | visible     p95  hidden     p95
total    |        -        -       -       - |        -       -       - |       -       -       -       -

decode   0 of 0 observed cells are right, 0 of 0 scoreable ones found
corners  precision -, recall -, - px in the median, - px at 95 %
cloud    0 of 0 vertex positions seen by 3 cameras or more have a point; 0 points, 0 of cells that no camera sees
mesh     0 vertex positions seen by 3 cameras or more, 0 by fewer
         - mm at 99 % where seen by 3 or more, - mm at most, - beyond 5 mm
)");
}

}  // namespace
}  // namespace weft
