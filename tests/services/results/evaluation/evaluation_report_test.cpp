#include "services/results/evaluation/evaluation_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "services/formats/files/json_file.h"
#include "services/results/evaluation/evaluation_verdict.h"
#include "services/results/report/job_page.h"
#include "tests/services/results/evaluation/sample_evaluation.h"
#include "tests/services/results/evaluation/sheet_on_disk.h"
#include "tests/services/results/report/page_data.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> MapsIn(const std::string& page) {
  std::vector<std::string> lines;
  const auto maps = MemberOf<v1::PageMaps>(page, "maps");
  for (const v1::PageMap& map : maps.maps())
    lines.push_back(absl::StrCat(map.title(), " | ", map.key().scale().label(), " | ",
                                 map.key().scale().unit(), " | ", map.key().scale().high()));
  for (const std::string& problem : maps.problems()) lines.push_back(problem);
  return lines;
}

JobEvaluation WithMaps() {
  JobEvaluation evaluation = SampleEvaluation();
  evaluation.shape = {{{0, 0, 0}, {10, 0, 0}, {0, 10, 1}}, {{0, 1, 2}}};
  evaluation.maps = {{0.5, 1, 0}, {1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 20, 30}};
  return evaluation;
}

TEST(EvaluationReport, MapsOnTheGarmentHaveTheirUnits) {
  JobEvaluation evaluation = WithMaps();
  EXPECT_THAT(MapsIn(MakeEvaluationReport(evaluation)),
              ElementsAre("Visibility: share of the frames that observe the vertex | share | % | 100",
                          "Vertex error, mean over the frames | error | mm | 3",
                          "Geodesic distortion, mean over sources and frames | distortion | mm | 6",
                          "Drift by texture flow | drift | mm/s | 10", "Exact drift | drift | mm/s | 30"));
  evaluation.fps = 0;
  evaluation.maps.visibility.clear(), evaluation.maps.error_mm.clear();
  evaluation.maps.distortion_mm.pop_back();
  EXPECT_THAT(
      MapsIn(MakeEvaluationReport(evaluation)),
      ElementsAre(
          "Drift by texture flow | drift | mm a frame | 10", "Exact drift | drift | mm a frame | 30",
          "Geodesic distortion, mean over sources and frames has no picture: colors: there are 2 for 3 "
          "vertices"));
  evaluation.shape = {};
  EXPECT_THAT(MapsIn(MakeEvaluationReport(evaluation)), testing::IsEmpty());
}

TEST(EvaluationReport, EachMeasureHasItsRowsOfValues) {
  const std::string page = MakeEvaluationReport(SampleEvaluation());
  const auto shown = MemberOf<v1::EvaluationPage>(page, "page");
  EXPECT_EQ(shown.headline(), EvaluationHeadline(SampleEvaluation()));
  ASSERT_EQ(shown.frames_size(), 2);
  ASSERT_EQ(shown.total().values_size(), shown.measures_size());
  std::string lines;
  for (int m = 0; m < shown.measures_size(); ++m) {
    const v1::EvaluationPage::Measure& measure = shown.measures(m);
    absl::StrAppend(&lines, measure.name(), " | ", measure.unit(), " | ", measure.decimals(), " | ",
                    measure.title(), " | ", measure.heading(), " | ", shown.total().values(m), " ",
                    shown.frames(0).values(m), " ", shown.frames(1).values(m), "\n");
  }
  EXPECT_EQ(lines, R"(coverage | % | 1 | Coverage, 3 cameras or more, % | coverage, % | 0.8125 0.8125 nan
two_view_share | % | 1 | Measured by 2 cameras only, % | by 2, % | 0.125 0.125 nan
decode_precision | % | 2 | Decoding, precision, % | precision, % | 0.99 0.99 nan
decode_recall | % | 2 | Decoding, recall, % | recall, % | 0.8 0.8 nan
decode_median_px | px | 3 | Decoding, error of centres, median, px | decoding, px | 0.25 0.25 nan
cloud_coverage | % | 2 | Cloud, vertices with a point, % | covered, % | 0.8 0.8 nan
cloud_median_mm | mm | 3 | Cloud, error, median, mm | cloud, mm | 0.625 0.625 nan
mesh_visible_mean_mm | mm | 3 | Vertex error, seen by 3 or more, mm | seen by 3+, mm | 4 4 nan
mesh_hidden_mean_mm | mm | 3 | Vertex error, seen by fewer, mm | by fewer, mm | 4 4 nan
texture_drift_mm_s | mm/s | 2 | Drift by texture flow, mm/s | texture drift, mm/s | 2.001 2.001 nan
texture_flow_lost | % | 1 | Texture flow, windows lost, % | flow lost, % | 0.0625 0.0625 nan
true_drift_observed_mm_s | mm/s | 2 | Exact drift, observed, mm/s | exact drift, mm/s | 5.001 5.001 nan
true_drift_inferred_mm_s | mm/s | 2 | Exact drift, inferred, mm/s | exact, inferred, mm/s | 6.001 6.001 nan
geodesic_distortion_mm | mm | 2 | Geodesic distortion, mm | distortion, mm | 1.25 1.25 nan
geodesic_distortion_relative | % | 2 | Geodesic distortion, of the distance, % | distortion, % | 0.015 0.015 nan
self_intersecting_pairs |  | 0 | Self-intersections, pairs of faces | self-intersections | 1234 1234 nan
jitter_observed_mm | mm | 3 | Jitter, observed, mm | jitter, mm | 7.001 7.001 nan
jitter_inferred_mm | mm | 3 | Jitter, inferred, mm | inferred, mm | 8.001 8.001 nan
jitter_of_truth_mm | mm | 3 | Jitter of the truth, mm | of the truth, mm | 9.001 9.001 nan
error_jitter_observed_mm | mm | 3 | Jitter of the error, observed, mm | error jitter, mm | 10.001 10.001 nan
error_jitter_inferred_mm | mm | 3 | Jitter of the error, inferred, mm | inferred, mm | 11.001 11.001 nan
reprojection_px | px | 3 | Reprojection error, px | reprojection, px | 14.001 14.001 nan
left_out_px | px | 3 | Left-out camera error, px | left out, px | 15.001 15.001 nan
texture_drift_mm | mm a frame | 3 | Drift by texture flow, mm a frame | texture drift, mm a frame | 1.001 1.001 nan
true_drift_observed_mm | mm a frame | 3 | Exact drift, observed, mm a frame | exact drift, mm a frame | 3.001 3.001 nan
true_drift_inferred_mm | mm a frame | 3 | Exact drift, inferred, mm a frame | exact, inferred, mm a frame | 4.001 4.001 nan
error_change_mm | mm a frame | 3 | Error, frame to frame, seen by 3 or more, mm a frame | error change, mm a frame | 12.001 12.001 nan
error_change_mm_s | mm/s | 2 | Error, frame to frame, seen by 3 or more, mm/s | error change, mm/s | 13.001 13.001 nan
)");
}

// Four frames of a sheet that is off by 4, 1, 3 and 2 mm.
class WrittenEvaluationTest : public testing::Test {
 protected:
  WrittenEvaluationTest() {
    const std::vector<VertexState> states(sheet_.rest().size(), VertexState::kObserved);
    for (const auto& [frame, off_mm] : {std::pair{"0", 4.0}, {"1", 1.0}, {"2", 3.0}, {"3", 2.0}}) {
      sheet_.WriteTruth(frame, sheet_.rest());
      sheet_.WriteResultMesh(frame, SheetOnDisk::Moved(sheet_.rest(), {off_mm, 0, 0}), states);
      v1::FrameReport report;
      report.set_state(v1::FRAME_STATE_DONE);
      EXPECT_TRUE(WriteJsonFile(sheet_.folder / absl::StrCat("result/", frame, "/report.json"), report).ok());
    }
  }

  JobEvaluation Evaluated() {
    auto evaluation = EvaluateJob(sheet_.Request());
    EXPECT_TRUE(evaluation.ok()) << evaluation.status();
    return *std::move(evaluation);
  }
  v1::JobPage WrittenPage(const JobEvaluation& evaluation) {
    EXPECT_TRUE(WriteEvaluation(sheet_.folder / "out", evaluation).ok());
    return MemberOf<v1::JobPage>(ReadBytes(sheet_.folder / "out/report.html"), "job");
  }

  SheetOnDisk sheet_;
};

TEST_F(WrittenEvaluationTest, ThePageShowsTheWorstFramesAndTheirErrors) {
  ASSERT_TRUE(WriteJsonFile(sheet_.folder / "result/job.json", v1::Job()).ok());
  JobEvaluation evaluation = Evaluated();
  const v1::JobPage page = WrittenPage(evaluation);
  std::vector<std::string> pictured;
  for (const v1::PageFramePictures& frame : page.pictures())
    pictured.push_back(absl::StrCat(frame.frame(), ": ", frame.why_shown()));
  EXPECT_THAT(pictured, ElementsAre("0: first frame, lowest coverage, largest error", "2: large error",
                                    "3: last frame"));
  const v1::PageSequence& sequence = page.sequence();
  ASSERT_EQ(sequence.colorings_size(), 3);
  EXPECT_EQ(sequence.colorings(2).name(), "error");
  EXPECT_EQ(sequence.colorings(2).key().scale().label(), "error");
  EXPECT_EQ(sequence.colorings(2).key().scale().unit(), "mm");
  EXPECT_EQ(sequence.colorings(2).key().scale().high(), 3) << "2.5 mm in the mean";
  // 1 mm of 3.
  const std::string& bytes = sequence.frames(1).bytes();
  EXPECT_EQ(static_cast<uint8_t>(bytes.back()), 85);
  for (const char* name : {"evaluation.json", "frames.csv", "cameras.csv"})
    EXPECT_NE(ReadBytes(sheet_.folder / absl::StrCat("out/", name)), "") << name;

  // What is not known has no colour.
  std::filesystem::remove(sheet_.folder / "take/truth/1/mesh.ply");
  EXPECT_EQ(static_cast<uint8_t>(WrittenPage(evaluation).sequence().frames(1).bytes().back()), 255);
  evaluation.maps.error_mm.clear();
  EXPECT_EQ(WrittenPage(evaluation).sequence().colorings_size(), 2);
}

TEST_F(WrittenEvaluationTest, WithoutAJobThereIsNoneOnThePageAndABrokenOneIsNamed) {
  const JobEvaluation evaluation = Evaluated();
  ASSERT_TRUE(WriteEvaluation(sheet_.folder / "out", evaluation).ok());
  EXPECT_THAT(ReadBytes(sheet_.folder / "out/report.html"), HasSubstr("\n\"job\":null"));
  WriteBytes(sheet_.folder / "result/job.json", "{");
  EXPECT_THAT(std::string(WriteEvaluation(sheet_.folder / "other", evaluation).message()),
              HasSubstr("job.json"));
  EXPECT_FALSE(std::filesystem::exists(sheet_.folder / "other"));
}

}  // namespace
}  // namespace weft
