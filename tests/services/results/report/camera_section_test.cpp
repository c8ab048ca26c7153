#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/results/report/job_summary.h"
#include "services/results/report/report_sections.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

JobSummary OneCamera(const CameraSummary& camera) {
  JobSummary summary;
  summary.cameras = {camera};
  return summary;
}

TEST(CameraSection, IsEmptyWithoutCameras) { EXPECT_EQ(CameraSection({}), ""); }

TEST(CameraSection, SmallMeansHaveADecimal) {
  CameraSummary camera{.camera = "<c>", .frames_seen = 3, .centers = 10, .corners = 300};
  const std::string html = CameraSection(OneCamera(camera));
  EXPECT_THAT(html, HasSubstr("<bdi>&lt;c&gt;</bdi>"));
  EXPECT_THAT(html, HasSubstr("<td>3.3<i class=\"bar\"><i style=\"width:100.0%\">"));
  EXPECT_THAT(html, HasSubstr("<td>100</td>"));
  EXPECT_THAT(html, HasSubstr("Every camera gave a usable image in every frame."));
}

TEST(CameraSection, ThreeReasonsForMissingImagesAreShown) {
  CameraSummary camera{.camera = "c", .frames_missing = 6};
  camera.missing_reasons = {{"dark", 3}, {"gone", 1}, {"x", 1}, {"y", 1}};
  EXPECT_THAT(CameraSection(OneCamera(camera)),
              HasSubstr("<td>6 of 6</td><td>dark (3 frames)<br>gone<br>x<br>and 1 more</td>"));
}

TEST(CameraSection, AShiftThatIsHardlyChanceIsBold) {
  CameraSummary camera{
      .camera = "c", .frames_seen = 1, .frames_with_bias = 1, .bias_x_px = 0.3, .bias_y_px = 0.4};
  camera.bias_significance = 5;
  EXPECT_THAT(CameraSection(OneCamera(camera)), HasSubstr("<td><b>0.50 (5.0 \xCF\x83)</b></td>"));
  camera.bias_significance = 3;
  EXPECT_THAT(CameraSection(OneCamera(camera)), HasSubstr("<td>0.50 (3.0 \xCF\x83)</td>"));
}

TEST(CameraSection, RareReasonsShareAColumn) {
  CameraSummary camera{.camera = "c", .frames_seen = 1};
  for (const char* reason : {"a", "b", "d", "e", "f"}) camera.patches_rejected[reason] = 20;
  EXPECT_THAT(CameraSection(OneCamera(camera)), Not(HasSubstr("other reasons")));
  camera.patches_rejected["rare_one"] = 7;
  const std::string html = CameraSection(OneCamera(camera));
  EXPECT_THAT(html, HasSubstr("Rejected: other reasons"));
  EXPECT_THAT(html, HasSubstr("<td>20</td><td>7</td></tr>"));
  EXPECT_THAT(html, Not(HasSubstr("rare one")));
}

}  // namespace
}  // namespace weft
