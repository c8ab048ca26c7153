#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/results/report/job_summary.h"
#include "services/results/report/report_sections.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

v1::FrameReport FrameWithCells(int centers, int rejected) {
  v1::FrameReport frame;
  frame.mutable_cloud()->set_centers(centers);
  v1::ReasonCount& reason = *frame.mutable_cloud()->add_rejected();
  reason.set_reason("too_few_views");
  reason.set_count(rejected);
  return frame;
}

v1::FrameReport FrameWithStage(int iterations) {
  v1::FrameReport frame;
  v1::AlignmentStage& stage = *frame.mutable_mesh()->add_stages();
  stage.set_name("rigid_fit");
  stage.set_iterations(iterations);
  stage.set_energy_before(52'000);
  stage.set_energy_after(0.5);
  stage.set_time_ms(40);
  return frame;
}

TEST(StageSections, CellsAreMeansOverTheClouds) {
  EXPECT_EQ(CellSection({v1::FrameReport()}), "");
  const std::string html = CellSection({FrameWithCells(8, 3), FrameWithCells(12, 4), v1::FrameReport()});
  EXPECT_THAT(html, HasSubstr("<td><b>triangulated</b></td><td>10</td>"));
  EXPECT_THAT(html, HasSubstr("<td>too few views</td><td>3.5</td><td>seen by fewer cameras"));
}

TEST(StageSections, AlignmentShowsMediansAndTheirRange) {
  EXPECT_EQ(AlignmentSection({}), "");
  EXPECT_THAT(AlignmentSection({FrameWithStage(4), FrameWithStage(8)}),
              HasSubstr("<td>rigid fit</td><td>2</td><td>6 (4 to 8)</td><td>52,000</td><td>0.5</td>"
                        "<td>40\xC2\xA0ms</td>"));
  EXPECT_THAT(AlignmentSection({FrameWithStage(4)}), HasSubstr("<td>1</td><td>4</td>"));
}

TEST(StageSections, GarmentsSayWhichLiesOverWhich) {
  JobSummary summary;
  EXPECT_EQ(GarmentSection(summary), "");
  summary.garments = {{.id = "shirt",
                       .vertices = 1200,
                       .observed = 9,
                       .observable = 10,
                       .sigmas_mm = {0.1, 0.3},
                       .lowest_coverage = 0.8,
                       .lowest_coverage_frame = "7"}};
  summary.overlaps[{"shirt", "coat"}] = 1;
  const std::string html = GarmentSection(summary);
  EXPECT_THAT(html, HasSubstr("coat lies over shirt in 1 frame."));
  EXPECT_THAT(html, HasSubstr("<td>shirt</td><td>1,200</td><td>90.0\xC2\xA0%</td><td>80.0\xC2\xA0%</td>"
                              "<td>7</td><td>0.200</td>"));
}

TEST(StageSections, AScanThatFoundNothingHasNoDistance) {
  EXPECT_EQ(ScanSection({v1::FrameReport()}), "");
  v1::FrameReport frame;
  frame.mutable_mesh()->mutable_scan()->set_points(100);
  const std::string html = ScanSection({frame});
  EXPECT_THAT(html, HasSubstr("0 of 100 points found the cloth in 1 frame;"));
  EXPECT_THAT(html, HasSubstr("<td>100</td><td>0</td><td>\xE2\x80\x93</td>"));
}

}  // namespace
}  // namespace weft
