// A result whose vertices slide over the true surface at a known speed, evaluated from its files and
// pictures.
#include <gtest/gtest.h>

#include <filesystem>

#include "evaluation/error_summary.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/synthetic/take_writer.h"
#include "services/formats/synthetic/truth_file.h"
#include "services/results/evaluation/evaluate_job.h"
#include "services/results/evaluation/evaluation_report.h"
#include "services/results/evaluation/evaluation_text.h"
#include "services/results/evaluation/evaluation_verdict.h"
#include "simulation/take_presets.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/report/page_data.h"
#include "weft/v1/evaluation.pb.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {
namespace {

constexpr double kFps = 30;

class SlidingResultTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    SyntheticTakeOptions options = *SyntheticPreset("tiny", 3);
    options.performance.frames = 3;
    auto take = SyntheticTake::Make(options);
    ASSERT_TRUE(take.ok()) << take.status();
    take_ = new SyntheticTake(*std::move(take));
    const auto take_folder = TakeFolder::Open(*folder_ / "take", "test");
    ASSERT_TRUE(take_folder.ok()) << take_folder.status();
    ASSERT_TRUE(WriteSyntheticTake(*take_, *take_folder).ok());
  }
  static void TearDownTestSuite() {
    delete take_;
    delete folder_;
  }

  // Every vertex with a cell sits where the print of the true surface is so many mm further along the row.
  static void WriteResult(const std::string& result, double slide_mm_s) {
    const Template& garment = take_->garment();
    const PrintLocator print(PrintFromVertexNodes(garment.rest.faces, garment.node_of_vertex));
    const double cell_mm = take_->board().cell_mm;
    for (int f = 0; f < take_->frames(); ++f) {
      const std::string name = "/000" + std::to_string(f);
      const auto read = ReadMesh(*folder_ / "take/truth" + name + "/mesh.ply");
      ASSERT_TRUE(read.ok()) << read.status();
      const TriangleMesh& truth = *read;
      RegisteredMesh mesh;
      mesh.vertices_mm = truth.vertices_mm;
      for (size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
        const VertexNode& cell = garment.node_of_vertex[v];
        const double shift = slide_mm_s / kFps * f / cell_mm;
        const auto at = cell.row >= 0 ? print.Find({cell.col + 0.5 + shift, cell.row + 0.5}) : std::nullopt;
        if (at) mesh.vertices_mm[v] = PositionOf(*at, truth.vertices_mm, truth.faces);
        mesh.state.push_back(at ? VertexState::kObserved : VertexState::kInferred);
      }
      mesh.sigma_mm.assign(mesh.vertices_mm.size(), 0.1f);
      mesh.views.assign(mesh.vertices_mm.size(), 4);
      const std::string folder = result + name;
      std::filesystem::create_directories(folder);
      ASSERT_TRUE(WriteRegisteredMesh(folder + "/mesh.ply", mesh, truth.faces).ok());
    }
  }

  static JobEvaluation Run(const std::string& result, bool with_truth = true) {
    EvaluationRequest request;
    request.result = result;
    request.dump = *folder_ / "take", request.rig = *folder_ / "take/rig.json";
    request.garment = *folder_ / "take/template";
    if (!with_truth) request.fps = kFps;  // else by the times of the truth
    if (!with_truth) std::filesystem::rename(*folder_ / "take/truth", *folder_ / "truth");
    auto evaluation = EvaluateJob(request);
    if (!with_truth) std::filesystem::rename(*folder_ / "truth", *folder_ / "take/truth");
    EXPECT_TRUE(evaluation.ok()) << evaluation.status();
    return evaluation.ok() ? *std::move(evaluation) : JobEvaluation();
  }

  static TempFolder* folder_;
  static SyntheticTake* take_;
};
TempFolder* SlidingResultTest::folder_ = nullptr;
SyntheticTake* SlidingResultTest::take_ = nullptr;

TEST_F(SlidingResultTest, DriftIsTheSpeedOfTheSlide) {
  constexpr double kSpeed_mm_s = 2;
  WriteResult(*folder_ / "sliding", kSpeed_mm_s);
  const JobEvaluation evaluation = Run(*folder_ / "sliding");
  const FrameMetrics& total = evaluation.total_metrics;
  ASSERT_TRUE(total.true_drift_observed_mm_s && total.texture_drift_mm_s);
  EXPECT_NEAR(total.true_drift_observed_mm_s->mean, kSpeed_mm_s, 0.05 * kSpeed_mm_s);
  EXPECT_NEAR(evaluation.fps, kFps, 1e-3);
  EXPECT_GT(total.texture_drift_mm_s->count, 500);
  EXPECT_NEAR(total.texture_drift_mm_s->mean, kSpeed_mm_s, 0.05 * kSpeed_mm_s);
}

TEST_F(SlidingResultTest, PerfectResultHasNoDriftAndEveryFileIsWritten) {
  WriteResult(*folder_ / "perfect", 0);
  const JobEvaluation evaluation = Run(*folder_ / "perfect");
  const FrameMetrics& total = evaluation.total_metrics;
  EXPECT_LT(total.true_drift_observed_mm_s->mean, 0.01);
  EXPECT_LT(total.texture_drift_mm_s->mean, 0.8);
  EXPECT_EQ(total.coverage, 1);
  EXPECT_GT(total.jitter_observed_mm->mean, 0);  // the cloth itself swings
  EXPECT_FALSE(total.reprojection_px);

  ASSERT_TRUE(WriteEvaluation(*folder_ / "out", evaluation).ok());
  v1::Evaluation read;
  ASSERT_TRUE(ReadJsonFile(*folder_ / "out/evaluation.json", read).ok());
  EXPECT_EQ(read.paper_size(), 4);
  EXPECT_EQ(read.visibility_histogram(9), 1152u);
  EXPECT_NEAR(read.total().measures().texture_drift_mm_s().mean(), total.texture_drift_mm_s->mean, 1e-9);
  bool told = false;  // why there is no reprojection error
  for (const auto& remark : read.remarks())
    told = told || remark.reason().find("--observations") != std::string::npos;
  EXPECT_TRUE(told);
  for (const char* name : {"frames.csv", "cameras.csv", "report.html"})
    EXPECT_TRUE(std::filesystem::exists(*folder_ / ("out/" + std::string(name)))) << name;
  const std::string page = MakeEvaluationReport(evaluation);
  EXPECT_EQ(MemberOf<v1::Evaluation>(page, "evaluation").SerializeAsString(), read.SerializeAsString());
  EXPECT_GT(MemberOf<v1::PageMaps>(page, "maps").maps_size(), 2);
  EXPECT_EQ(MemberOf<v1::EvaluationPage>(page, "page").headline(), EvaluationHeadline(evaluation));
  EXPECT_EQ(Run(*folder_ / "perfect").total_metrics.texture_drift_mm_s->mean, total.texture_drift_mm_s->mean);
}

TEST_F(SlidingResultTest, WithoutATruthWhatNeedsNoneIsMeasured) {
  WriteResult(*folder_ / "blind", 2);
  const JobEvaluation evaluation = Run(*folder_ / "blind", false);
  EXPECT_EQ(evaluation.frames.size(), 3u);
  EXPECT_TRUE(evaluation.total_metrics.texture_drift_mm_s);
  EXPECT_TRUE(evaluation.total_metrics.distortion_mm);
  EXPECT_FALSE(evaluation.total_metrics.true_drift_observed_mm_s);
  EXPECT_FALSE(evaluation.total.mesh);
  EXPECT_NE(EvaluationTable(evaluation).find("there is no ground truth"), std::string::npos);
}

// Pictures are compared where the cells were read in both frames: nothing else is before the cloth there.
TEST_F(SlidingResultTest, PicturesAreComparedWhereCellsWereRead) {
  const std::string result = *folder_ / "read";
  WriteResult(result, 0);
  const auto write = [&](int frame, bool all) {
    const std::string name = "/000" + std::to_string(frame);
    const auto truth = ReadFrameTruth(*folder_ / "take/truth" + name);
    ASSERT_TRUE(truth.ok()) << truth.status();
    std::vector<ImageObservations> images;
    for (const ViewTruth& view : truth->views) {
      images.push_back({view.camera_id, {}});
      for (const NodeTruth& node : view.nodes)
        if (all && node.visible)
          images.back().observations.push_back({node.pixel_px.x(), node.pixel_px.y(), node.node, 0.1f, 1});
    }
    ASSERT_TRUE(WriteObservations(result + name + "/observations.csv", images).ok());
  };
  const auto measured = [&] {
    const auto& drift = Run(result).total_metrics.texture_drift_mm;
    return drift ? drift->count : 0;
  };
  for (int f = 0; f < 3; ++f) write(f, true);
  EXPECT_GT(measured(), 500);
  write(1, false);
  EXPECT_EQ(measured(), 0) << "each step has frame 1 in it";
}

}  // namespace
}  // namespace weft
