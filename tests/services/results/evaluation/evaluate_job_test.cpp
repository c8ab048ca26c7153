#include "services/results/evaluation/evaluate_job.h"

#include <gtest/gtest.h>

#include "services/formats/files/cloud_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/synthetic/take_writer.h"
#include "services/formats/synthetic/truth_file.h"
#include "services/results/evaluation/evaluation_text.h"
#include "simulation/take_presets.h"
#include "tests/capture/temp_folder.h"
#include "weft/v1/evaluation.pb.h"

namespace weft {
namespace {

// A tiny take, and a job's result as good as the truth for its first frame only.
class EvaluateJobTest : public testing::Test {
 protected:
  void SetUp() override {
    SyntheticTakeOptions options = *SyntheticPreset("tiny", 1);
    options.performance.frames = 2;
    auto take = SyntheticTake::Make(options);
    ASSERT_TRUE(take.ok()) << take.status();
    const auto take_folder = TakeFolder::Open(folder_ / "take", "test");
    ASSERT_TRUE(take_folder.ok()) << take_folder.status();
    ASSERT_TRUE(WriteSyntheticTake(*take, *take_folder).ok());
    const auto truth = ReadFrameTruth(folder_ / "take/truth/0000");
    ASSERT_TRUE(truth.ok()) << truth.status();
    std::filesystem::create_directories(folder_ / "result/0000");

    std::vector<ImageObservations> images;
    for (const ViewTruth& view : truth->views) {
      images.push_back({view.camera_id, {}});
      for (const NodeTruth& n : view.nodes)
        if (n.visible)
          images.back().observations.push_back({n.pixel_px.x(), n.pixel_px.y(), n.node, 0.1f, 1});
    }
    ASSERT_TRUE(WriteObservations(folder_ / "result/0000/observations.csv", images).ok());
    Cloud cloud;
    for (size_t v = 0; v < take->garment().node_of_vertex.size(); ++v) {
      const VertexNode& cell = take->garment().node_of_vertex[v];
      CloudPoint point;
      point.node = {cell.row, cell.col, NodeKind::kCenter};
      point.position_mm = truth->mesh.vertices_mm[v];
      if (cell.row >= 0) cloud.points.push_back(point);
    }
    ASSERT_TRUE(WriteCloud(folder_ / "result/0000/cloud.ply", cloud).ok());
    RegisteredMesh mesh;
    mesh.vertices_mm = truth->mesh.vertices_mm;
    mesh.state.assign(mesh.vertices_mm.size(), VertexState::kObserved);
    mesh.sigma_mm.assign(mesh.vertices_mm.size(), 0);
    mesh.views.assign(mesh.vertices_mm.size(), 4);
    ASSERT_TRUE(WriteRegisteredMesh(folder_ / "result/0000/mesh.ply", mesh, truth->mesh.faces).ok());
  }

  absl::StatusOr<JobEvaluation> Run() {
    EvaluationRequest request;
    request.result = folder_ / "result", request.truth = folder_ / "take/truth";
    return EvaluateJob(request);
  }

  TempFolder folder_;
};

TEST_F(EvaluateJobTest, PerfectFrameScoresFullAndAbsentFrameIsMissing) {
  const auto evaluation = Run();
  ASSERT_TRUE(evaluation.ok()) << evaluation.status();
  ASSERT_EQ(evaluation->frames.size(), 2u);
  EXPECT_TRUE(evaluation->frames[0].missing.empty());
  EXPECT_EQ(evaluation->frames[1].missing,
            (std::vector<std::string>{"observations.csv", "cloud.ply", "mesh.ply"}));
  const FrameScore& total = evaluation->total;
  EXPECT_EQ(total.centers->Precision(), 1);
  EXPECT_EQ(total.centers->Recall(), 1);
  EXPECT_EQ(total.corners->Recall(), 1);
  EXPECT_LT(Summarize(total.centers->errors_px)->max, 2e-4);  // digits of the files
  EXPECT_EQ(total.cloud->Coverage(), 1);
  EXPECT_LT(Summarize(total.mesh->visible_mm)->max, 1e-4);
}

TEST_F(EvaluateJobTest, TableAndJsonSayWhatIsMissing) {
  std::filesystem::remove(folder_ / "result/0000/observations.csv");
  const auto evaluation = Run();
  ASSERT_TRUE(evaluation.ok()) << evaluation.status();
  const std::string table = EvaluationTable(*evaluation);
  EXPECT_NE(table.find("no observations.csv"), std::string::npos);
  EXPECT_NE(table.find("no mesh.ply"), std::string::npos);
  EXPECT_NE(table.find("100.00 %"), std::string::npos);
  const auto json = EvaluationJson(*evaluation);
  ASSERT_TRUE(json.ok()) << json.status();
  v1::Evaluation read;
  ASSERT_TRUE(ParseJson(*json, "json", read).ok());
  EXPECT_FALSE(read.total().has_centers());
  EXPECT_TRUE(read.frames(0).has_mesh());
  EXPECT_FALSE(read.frames(1).has_mesh());
  EXPECT_EQ(read.frames(1).missing_size(), 3);
}

TEST_F(EvaluateJobTest, BrokenFilesAreNamed) {
  WriteBytes(folder_ / "result/0000/cloud.ply", "ply\n");
  const auto evaluation = Run();
  EXPECT_EQ(evaluation.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(evaluation.status().message().find("0000/cloud.ply"), std::string::npos);
}

TEST_F(EvaluateJobTest, WrongFoldersAreRefused) {
  for (const auto& [result, truth] :
       {std::pair{"nowhere", "take/truth"}, {"result", "take"}, {"nowhere", ""}}) {
    EvaluationRequest request;
    request.result = folder_ / result;
    if (*truth) request.truth = folder_ / truth;
    EXPECT_EQ(EvaluateJob(request).status().code(), absl::StatusCode::kNotFound) << result << " " << truth;
  }
}

TEST_F(EvaluateJobTest, TruthsOfOtherFramesAreNamed) {
  std::filesystem::rename(folder_ / "result/0000", folder_ / "result/0007");
  const auto evaluation = Run();
  EXPECT_EQ(evaluation.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(evaluation.status().message().find(folder_ / "take/truth: has the frames 0000 to 0001"),
            std::string::npos)
      << evaluation.status();
}

}  // namespace
}  // namespace weft
