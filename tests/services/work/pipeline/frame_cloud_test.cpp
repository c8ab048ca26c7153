#include "services/work/pipeline/frame_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::StartsWith;

TEST(FrameCloud, TheReasonIsTheFirstThatCanBeMended) {
  std::vector<ViewObservations> views(3);
  std::vector<v1::ViewReport> reports(3);
  EXPECT_THAT(NoCloudReason(views, reports, 2), StartsWith("no cell of the board was decoded in any view"));
  views[0].observations.resize(7);
  EXPECT_THAT(NoCloudReason(views, reports, 2),
              StartsWith("no cell could be triangulated from 7 observations of cells"));
  reports[1].set_missing_reason("too dark");
  reports[2].set_missing_reason("gone");
  EXPECT_EQ(
      NoCloudReason(views, reports, 2),
      "only 1 of 3 cameras have a usable image, triangulation needs 2; the first that has none: too dark");
}

TEST(FrameCloud, CamerasThatAreEnoughAreNotTheReason) {
  std::vector<ViewObservations> views(3);
  std::vector<v1::ViewReport> reports(3);
  reports[0].set_missing_reason("gone");
  EXPECT_THAT(NoCloudReason(views, reports, 2), StartsWith("no cell of the board"));
  EXPECT_EQ(NoCloudReason(views, reports, 3),
            "only 2 of 3 cameras have a usable image, triangulation needs 3; the first that has none: gone");
  EXPECT_EQ(NoCloudReason(views, std::vector<v1::ViewReport>(3), 4),
            "only 3 of 3 cameras have a usable image, triangulation needs 4");
}

}  // namespace
}  // namespace weft
