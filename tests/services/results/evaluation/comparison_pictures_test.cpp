// Plots and maps of a comparison.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "services/results/evaluation/comparison_report.h"
#include "tests/services/results/evaluation/sample_comparison.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::string PlotLine(const ComparisonPlot& plot) {
  std::string line =
      absl::StrCat(plot.name, " | ", plot.text.title, " | ", plot.text.unit, " | ", plot.text.decimals,
                   plot.text.from_zero ? " from zero" : "", plot.text.whole_percent ? " whole" : "",
                   " style ", static_cast<int>(plot.text.first_style));
  for (const PlotSeries& series : plot.series) {
    absl::StrAppend(&line, " | ", series.name);
    for (const double value : series.values) absl::StrAppend(&line, " ", value);
  }
  return line;
}

TEST(ComparisonPictures, MeasuresAndTheDistanceHaveAPlot) {
  std::vector<std::string> lines;
  for (const ComparisonPlot& plot : ComparisonPlots(SampleComparison())) lines.push_back(PlotLine(plot));
  EXPECT_THAT(
      lines,
      ElementsAre(
          "coverage | Coverage, 3 cameras or more, % | % | 1 from zero style 0 | A 0.8125 nan | B 0.25 nan",
          "jitter_observed_mm | Jitter, observed, mm | mm | 3 style 0 | A 7.001 nan | B 7.001 nan",
          "distance_mm | Distance of the meshes' vertices, mm | mm | 3 from zero whole style 2 | mean 0.501 "
          "nan | 95 % 0.503 nan"));
  JobComparison comparison = SampleComparison();
  // 0.8125 of A beside less than half, half and more than half of it.
  for (const auto& [of_b, from_zero] : {std::pair{0.25, true}, {0.40625, false}, {0.5, false}}) {
    comparison.b.frames[0].metrics.coverage = of_b;
    EXPECT_EQ(ComparisonPlots(comparison)[0].text.from_zero, from_zero) << of_b;
  }
  comparison.total.distance_mm.reset();
  EXPECT_EQ(ComparisonPlots(comparison).size(), 2u);
  comparison.a.frames.resize(1);
  EXPECT_THAT(ComparisonPlots(comparison), IsEmpty());
}

TEST(ComparisonPictures, FramesWithoutAMeshOfEitherAreMarked) {
  JobComparison comparison = SampleComparison();
  EXPECT_THAT(ComparisonFrames(comparison).names, ElementsAre("0001", "0002"));
  EXPECT_THAT(ComparisonFrames(comparison).without_mesh, ElementsAre(false, true));
  comparison.a.frames[0].missing = {"mesh.ply"};
  EXPECT_THAT(ComparisonFrames(comparison).without_mesh, ElementsAre(true, true));
}

std::string MapLine(const std::string& name, const GarmentMap& map) {
  return absl::StrCat(name, " | ", map.title, " | ", map.label, " | ", map.unit, " | ", map.values.at(0), " ",
                      map.values.at(1), " | ", map.range.low, " to ", map.range.high);
}

TEST(ComparisonPictures, EachDifferenceHasAMap) {
  std::vector<std::string> lines;
  for (const auto& [name, map] : ComparisonMaps(SampleComparison())) lines.push_back(MapLine(name, map));
  EXPECT_THAT(
      lines,
      ElementsAre("distance_mm | Distance of A and B, mean over the frames | distance | mm | 1 2 | 0 to 2",
                  "distance_sigmas | Distance of A and B in sigmas of both, mean (beyond 3.4 is hardly "
                  "noise) | distance | sigmas | 3 4 | 0 to 4",
                  "error_difference_mm | Vertex error, A minus B (blue: A is better) | A minus B | mm | 5 6 "
                  "| -6 to 6",
                  "visibility_difference | Visibility, A minus B (orange: A observes more) | A minus B | % | "
                  "50 25 | -50 to 50",
                  "distortion_difference_mm | Geodesic distortion, A minus B (blue: A is better) | A minus B "
                  "| mm | 7 8 | -8 to 8",
                  "texture_drift_difference | Drift by texture flow, A minus B (blue: A is better) | A minus "
                  "B | mm/s | 9 10 | -10 to 10",
                  "exact_drift_difference | Exact drift, A minus B (blue: A is better) | A minus B | mm/s | "
                  "11 12 | -15 to 15"));
  JobComparison comparison;
  EXPECT_THAT(ComparisonMaps(comparison), IsEmpty());
  comparison.maps.a_minus_b.true_drift = {1, 2};
  const auto maps = ComparisonMaps(comparison);
  ASSERT_EQ(maps.size(), 1u);
  EXPECT_EQ(maps[0].second.unit, "mm a frame");
}

}  // namespace
}  // namespace weft
