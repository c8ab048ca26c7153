#include "services/tools/cli/sync_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Of so many cameras c0, c1 ..., camera k off by 0.1 k ms in each of three sets.
SyncAnalysis AnalysisOf(int cameras) {
  SyncAnalysis analysis;
  analysis.report.mutable_take()->set_id("take<1>");
  analysis.report.set_sets(1234);
  analysis.report.set_sets_complete(1230);
  analysis.report.set_sets_dropped(4);
  analysis.report.set_spread_median_ms(0.25);
  analysis.set_names = {"0", "1", "2"};
  for (int k = 0; k < cameras; ++k) {
    const std::string id = "c" + std::to_string(k);
    analysis.report.add_timing()->set_camera(id);
    analysis.report.add_clocks()->set_camera(id);
    analysis.series.push_back({id, std::vector<double>(3, 0.1 * k), {}, {}});
  }
  return analysis;
}

size_t CountOf(const std::string& page, const std::string& text) {
  size_t count = 0;
  for (size_t at = page.find(text); at != std::string::npos; at = page.find(text, at + 1)) ++count;
  return count;
}

TEST(SyncPageTest, HeadCountsSetsAndNoNameBecomesMarkup) {
  const std::string page = SyncPage(AnalysisOf(2));
  EXPECT_THAT(
      page,
      HasSubstr("1,230 of 1,234 frame sets complete, 4 dropped. Between the cameras of a set: 0.2500 ms in "
                "the median"));
  EXPECT_THAT(page, AllOf(HasSubstr("take&lt;1&gt;"), Not(HasSubstr("take<1>"))));
}

TEST(SyncPageTest, PartsWithoutContentAreLeftOut) {
  SyncAnalysis analysis = AnalysisOf(2);
  const std::string bare = SyncPage(analysis);
  EXPECT_THAT(bare, HasSubstr("Offset from the other cameras"));
  for (const char* heading :
       {"Findings", "Missing frames", "Clock against the host", "Offset from the PTP master", "Events"})
    EXPECT_EQ(bare.find(std::string(">") + heading + "<"), std::string::npos) << heading;
  analysis.report.add_findings("c1 jumps; look for <loose> cables");
  v1::TakeCause& cause = *analysis.report.add_causes();
  cause.set_camera("c1");
  cause.set_cause("3 packets lost");
  cause.set_count(17);
  analysis.series[1].clock_ms = {0, 1};
  const std::string page = SyncPage(analysis);
  EXPECT_THAT(page, HasSubstr("<li>c1 jumps; look for &lt;loose&gt; cables</li>"));
  EXPECT_THAT(page, AllOf(HasSubstr("3 packets lost"), HasSubstr("17")));
  EXPECT_THAT(page, HasSubstr("Clock against the host"));
}

TEST(SyncPageTest, CamerasThatStrayFarthestHaveAPlotEach) {
  const std::string page = SyncPage(AnalysisOf(9));
  // Six of nine: c3 to c8.
  for (int k = 0; k < 9; ++k)
    EXPECT_EQ(CountOf(page, "Offset, camera c" + std::to_string(k)) > 0, k >= 3) << k;
  const std::string one = SyncPage(AnalysisOf(1));
  EXPECT_THAT(one, HasSubstr("Offset, camera c0"));
  EXPECT_THAT(one, Not(HasSubstr("all cameras")));
}

TEST(SyncPageTest, ACameraWithoutAnyValueHasNoPlot) {
  SyncAnalysis analysis = AnalysisOf(2);
  analysis.series[0].offset_ms.assign(3, std::nan(""));
  const std::string page = SyncPage(analysis);
  EXPECT_EQ(CountOf(page, "Offset, camera c0"), 0u);
  EXPECT_GT(CountOf(page, "Offset, camera c1"), 0u);
  EXPECT_THAT(page, HasSubstr("3 frames missing"));
}

}  // namespace
}  // namespace weft
