#include "services/results/evaluation/comparison_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "services/results/evaluation/comparison_text.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/evaluation/sample_comparison.h"
#include "tests/services/results/report/page_data.h"
#include "tests/services/results/report/proto_text.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

JobComparison Shown() {
  JobComparison comparison = SampleComparison();
  comparison.a.shape = {{{0, 0, 0}, {10, 0, 0}}, {}};
  return comparison;
}

TEST(ComparisonReport, ThePageHoldsPlotsCamerasAndNotes) {
  const std::string page = MakeComparisonReport(Shown(), nullptr, {"a note"});
  EXPECT_NE(page.find("<title>Weft comparison</title>"), std::string::npos);
  EXPECT_NE(page.find("\n\"meshes\":null"), std::string::npos);
  EXPECT_EQ(MemberOf<v1::PageMaps>(page, "maps").problems_size(), 7) << "a shape without faces";
  EXPECT_EQ(
      MemberOf<v1::ComparisonPage>(page, "page").DebugString(),
      TextOf<v1::ComparisonPage>(
          R"( headline: "2 frames: A is better in 1 measure, B in none; no measure shows no significant difference"
decimals: 1 decimals: 3 plots { title: "Coverage, 3 cameras or more, %" unit: "%" decimals: 1 from_zero:
true series { name: "A" values: 0.8125 values: nan } series { name: "B" values: 0.25 values: nan } }
plots { title: "Jitter, observed, mm" unit: "mm" decimals: 3 series { name: "A" values: 7.001 values:
nan } series { name: "B" values: 7.001 values: nan } } plots { title: "Distance of the meshes\'
vertices, mm" unit: "mm" decimals: 3 from_zero: true whole_percent: true first_style: 2 series { name:
"mean" values: 0.501 values: nan } series { name: "95 %" values: 0.503 values: nan } }
 without_mesh:
false without_mesh: true a_cameras { camera: "c01" observations: 40 outliers: 3 reprojection_px { count:
2 mean: 0.375 median: 0.375 p95: 0.4875 max: 0.5 p99: 0.4975 } left_out_px { count: 2 mean: 1 median: 1
p95: 1.225 max: 1.25 p99: 1.245 } shift_x_px: 0.125 shift_y_px: -0.125 } b_cameras { camera: "c01"
observations: 40 outliers: 3 reprojection_px { count: 2 mean: 0.75 median: 0.75 p95: 0.975 max: 1 p99:
0.995 } left_out_px { count: 2 mean: 2 median: 2 p95: 2.45 max: 2.5 p99: 2.49 } shift_x_px: 0.25
shift_y_px: -0.25 } b_cameras { camera: "c02" observations: 40 outliers: 3 reprojection_px { count: 2
mean: 1.5 median: 1.5 p95: 1.95 max: 2 p99: 1.99 } left_out_px { count: 2 mean: 4 median: 4 p95: 4.9
max: 5 p99: 4.98 } shift_x_px: 0.5 shift_y_px: -0.5 } notes: "a note")"));
}

// Names below `folder`.
std::set<std::string> FilesBelow(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) names.insert(std::filesystem::relative(entry.path(), folder).string());
  return names;
}

TEST(ComparisonReport, FilesOfMeasuresThatAreNotThereAreNotWritten) {
  const TempFolder folder;
  JobComparison comparison = SampleComparison();
  ASSERT_TRUE(WriteComparison(folder / "all", comparison).ok());
  EXPECT_THAT(
      FilesBelow(folder / "all"),
      ElementsAre("cameras.csv", "comparison.json", "frames.csv", "measures.csv", "plots/coverage.svg",
                  "plots/distance_mm.svg", "plots/jitter_observed_mm.svg", "report.html", "vertices.csv"));
  EXPECT_EQ(ReadBytes(folder / "all/vertices.csv"), ComparedVertexCsv(comparison));
  EXPECT_EQ(ReadBytes(folder / "all/cameras.csv"), ComparedCameraCsv(comparison));
  comparison.a.shape = {{{0, 0, 0}, {10, 0, 0}, {0, 10, 1}}, {{0, 1, 2}}};
  comparison.maps = {};
  comparison.maps.distance_mm = {1, 2, 3};
  ASSERT_TRUE(WriteComparison(folder / "mapped", comparison).ok());
  EXPECT_TRUE(FilesBelow(folder / "mapped").contains("maps/distance_mm.svg"));
  comparison.maps = {};
  ASSERT_TRUE(WriteComparison(folder / "less", comparison).ok());
  EXPECT_FALSE(FilesBelow(folder / "less").contains("vertices.csv"));
  WriteBytes(folder / "file", "");
  EXPECT_FALSE(WriteComparison(folder / "file", comparison).ok());
}

}  // namespace
}  // namespace weft
