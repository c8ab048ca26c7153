#include "services/results/report/plot_axes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

BinValues OneValue(double value) { return {value, value, value}; }
BinValues NoBinValue() { return OneValue(std::nan("")); }

TEST(PlotAxes, TheLastBinMayBeSmaller) {
  const std::vector<PlotBin> bins = MakeBins(7, 3);
  ASSERT_EQ(bins.size(), 3u);
  EXPECT_EQ(bins[1].begin, 3u);
  EXPECT_EQ(bins[2].begin, 6u);
  EXPECT_EQ(bins[2].end, 7u);
}

TEST(PlotAxes, BinsLeaveOutWhatIsMissing) {
  const std::vector<double> values = {9, 1, std::nan(""), 3};
  const BinValues bin = ValuesIn({1, 4}, values);
  EXPECT_DOUBLE_EQ(bin.mean, 2);
  EXPECT_DOUBLE_EQ(bin.low, 1);
  EXPECT_DOUBLE_EQ(bin.high, 3);
  EXPECT_TRUE(std::isnan(ValuesIn({2, 3}, values).mean));
}

TEST(PlotAxes, LabelsHaveTheDecimalsThatTheStepNeeds) {
  EXPECT_THAT(TickLabels({0, 0.25, 0.5}, {}), ElementsAre("0.00", "0.25", "0.50"));
  EXPECT_THAT(TickLabels({0, 2000, 4000}, {}), ElementsAre("0", "2,000", "4,000"));
  EXPECT_THAT(TickLabels({0.5, 1}, {.unit = "%"}), ElementsAre("50\xC2\xA0%", "100\xC2\xA0%"));
}

TEST(PlotAxes, PercentagesEndAtAHundred) {
  const PlotText share = {.unit = "%", .from_zero = false};
  EXPECT_THAT(ValueTicks({OneValue(0.93)}, share),
              ElementsAre(DoubleNear(0.8, 1e-9), DoubleNear(0.85, 1e-9), DoubleNear(0.9, 1e-9),
                          DoubleNear(0.95, 1e-9), DoubleNear(1, 1e-9)));
  EXPECT_DOUBLE_EQ(ValueTicks({OneValue(0.93)}, {.unit = "%"}).front(), 0);
}

TEST(PlotAxes, AxesStartAtZeroOnlyWhereAsked) {
  EXPECT_DOUBLE_EQ(ValueTicks({OneValue(10), OneValue(14)}, {}).front(), 0);
  EXPECT_DOUBLE_EQ(ValueTicks({OneValue(10), OneValue(14)}, {.from_zero = false}).front(), 10);
  EXPECT_LE(ValueTicks({OneValue(-3), OneValue(1)}, {}).front(), -3);
  EXPECT_THAT(ValueTicks({NoBinValue()}, {}), ElementsAre(0, 0.25, 0.5, 0.75, 1));
}

TEST(PlotAxes, AValueBetweenMissingOnesIsAlone) {
  const std::vector<BinValues> bins = {OneValue(1), NoBinValue(), OneValue(2), OneValue(3)};
  EXPECT_TRUE(IsAlone(bins, 0));
  EXPECT_FALSE(IsAlone(bins, 1));
  EXPECT_FALSE(IsAlone(bins, 2));
  EXPECT_FALSE(IsAlone(bins, 3));
}

// The picture is 186 - 14 high and 548 - 62 wide between its axes.
TEST(PlotAxes, ValuesBeyondTheTicksStayInThePicture) {
  const PlotArea area(2, {0, 5, 10});
  EXPECT_DOUBLE_EQ(area.y(5), 100);
  EXPECT_DOUBLE_EQ(area.y(20), 14);
  EXPECT_DOUBLE_EQ(area.y(-1), 186);
  EXPECT_DOUBLE_EQ(area.x(0), 183.5);
  EXPECT_EQ(area.Path({OneValue(0), OneValue(10)}), "M183.5 186.0L426.5 14.0");
  EXPECT_EQ(area.Path({NoBinValue(), OneValue(10)}), "M426.5 14.0");
}

TEST(PlotAxes, LostFramesAreMarkedByBin) {
  const PlotFrames frames = {.names = {"1", "2", "<3>"}, .without_mesh = {true, true, false}};
  const PlotArea area(2, {0, 1});
  EXPECT_THAT(area.LostMarks(frames, {{0, 2}, {2, 3}}), HasSubstr("<title>frames 1 to 2: 2 without mesh<"));
  EXPECT_THAT(area.LostMarks(frames, {{0, 1}}), HasSubstr("<title>frame 1: no mesh<"));
  EXPECT_EQ(area.LostMarks(frames, {{2, 3}}), "");
  EXPECT_EQ(BinName({2, 3}, frames), "frame <3>");
  EXPECT_THAT(area.Axes(frames, {{0, 3}}, {"0", "1"}), Not(HasSubstr("<3>")));
}

TEST(PlotAxes, HoverTextsBearTheUnit) {
  EXPECT_EQ(ValueText(0.1416, {.unit = "mm", .decimals = 3}), "0.142\xC2\xA0mm");
  EXPECT_EQ(ValueText(0.952, {.unit = "%"}), "95.2\xC2\xA0%");
  EXPECT_EQ(ValueText(1234.4, {}), "1,234");
}

}  // namespace
}  // namespace weft
