#include "services/tools/cli/sync_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/services/results/report/page_data.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(SyncPageTest, HoldsTheReportAndASeriesPerCamera) {
  SyncAnalysis analysis;
  analysis.report.mutable_take()->set_id("take<1>");
  analysis.report.set_sets(1234);
  v1::TakeCause& cause = *analysis.report.add_causes();
  cause.set_camera("c1");
  cause.set_cause("3 packets lost");
  cause.set_count(17);
  analysis.set_names = {"0", "1"};
  analysis.series = {{"c0", {0.5, std::nan("")}, {0, 1, 2}, {}}, {"c1", {0, 0.25}, {}, {4}}};
  const std::string page = SyncPage(analysis);
  EXPECT_THAT(page, Not(HasSubstr("take<1>")));
  EXPECT_EQ(MemberOf<v1::SyncReport>(page, "report").SerializeAsString(),
            analysis.report.SerializeAsString());
  const auto shown = MemberOf<v1::SyncPage>(page, "page");
  EXPECT_THAT(shown.set_names(), ElementsAre("0", "1"));
  ASSERT_EQ(shown.series_size(), 2);
  EXPECT_EQ(shown.series(0).camera(), "c0");
  EXPECT_EQ(shown.series(0).offset_ms(0), 0.5);
  EXPECT_TRUE(std::isnan(shown.series(0).offset_ms(1)));
  EXPECT_THAT(shown.series(0).clock_ms(), ElementsAre(0, 1, 2));
  EXPECT_THAT(shown.series(1).ptp_us(), ElementsAre(4));
  ASSERT_EQ(shown.causes_size(), 1);
  EXPECT_THAT(shown.causes(0), HasSubstr("3 packets lost"));
}

}  // namespace
}  // namespace weft
