#include "services/results/report/paper_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kAdvice[] = "measures drift and distortion";
// Cells of a row without measures.
constexpr char kDashes[] = "<td>\xE2\x80\x93</td><td>\xE2\x80\x93</td><td>\xE2\x80\x93</td></tr>";

TEST(PaperTable, SaysHowToMeasureWhatIsMissing) {
  const std::string html = PaperSection({});
  EXPECT_THAT(html, HasSubstr(std::string("<td><b>This result</b></td>") + kDashes));
  EXPECT_THAT(html, HasSubstr(kAdvice));
  EXPECT_THAT(PaperSection({.drift_mm_s = 0.5}), HasSubstr(kAdvice));
  EXPECT_THAT(PaperSection({.drift_mm_s = 0.5, .geodesic_distortion_mm = 2}), Not(HasSubstr(kAdvice)));
}

TEST(PaperTable, CoverageOfASingleFrameHasNoRange) {
  EXPECT_THAT(PaperSection({.coverage = 0.8}), HasSubstr("<td>80.0\xC2\xA0%</td>"));
  EXPECT_THAT(PaperSection({.coverage = 0.8, .lowest_coverage = 0.7, .highest_coverage = 0.9}),
              HasSubstr("80.0\xC2\xA0% (70.0\xC2\xA0% to 90.0\xC2\xA0%)"));
}

// Halimi et al. 2022, Table 1 and Figure 7.
TEST(PaperTable, ThePapersOwnRowHasItsThreeFigures) {
  EXPECT_THAT(PaperSection({}),
              HasSubstr("<td>1.50</td><td>9.27</td><td>75.0\xC2\xA0% (54.0\xC2\xA0% to 90.0\xC2\xA0%)</td>"));
}

}  // namespace
}  // namespace weft
