#include "services/results/evaluation/evaluate_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>

#include "absl/strings/str_cat.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/synthetic/take_writer.h"
#include "services/formats/synthetic/truth_file.h"
#include "services/results/evaluation/evaluation_text.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/evaluation/sample_evaluation.h"
#include "tests/simulation/tiny_take.h"
#include "weft/v1/evaluation.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

// A tiny take, and a job's result as good as the truth for its first frame only.
class EvaluateJobTest : public testing::Test {
 protected:
  void SetUp() override {
    auto take = SyntheticTake::Make(TinyOptions(1, 2, 12));
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
  const auto json = ToJson(EvaluationMessage(*evaluation));
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

// Frames that weigh one and three, and one without a value.
TEST(EvaluationSum, TotalsAreMeansByCountsAndCountsAddUp) {
  EvaluationSum sum;
  for (const double base : {1.0, 3.0}) {
    FrameOutcome outcome;
    FrameMetrics& m = outcome.frame.metrics;
    const auto weight = static_cast<int64_t>(base);
    m.jitter_observed_mm = ErrorSummary{weight, base, 2 * base, 3 * base, 10 - base, 4 * base};
    m.coverage = base / 4;
    m.self_intersections = weight;
    outcome.frame.score.mesh.emplace().visible_mm.push_back(base);
    sum.Add(std::move(outcome));
  }
  sum.Add({});
  const auto evaluation = sum.Finish({}, {});
  ASSERT_TRUE(evaluation.ok()) << evaluation.status();
  const FrameMetrics& total = evaluation->total_metrics;
  ASSERT_TRUE(total.jitter_observed_mm);
  EXPECT_EQ(total.jitter_observed_mm->count, 4);
  EXPECT_DOUBLE_EQ(total.jitter_observed_mm->mean, 2.5);
  EXPECT_DOUBLE_EQ(total.jitter_observed_mm->median, 5);
  EXPECT_DOUBLE_EQ(total.jitter_observed_mm->p95, 7.5);
  EXPECT_DOUBLE_EQ(total.jitter_observed_mm->p99, 10);
  EXPECT_DOUBLE_EQ(total.jitter_observed_mm->max, 9);
  EXPECT_DOUBLE_EQ(*total.coverage, 0.5);
  EXPECT_EQ(total.self_intersections, 4);
  EXPECT_FALSE(total.jitter_inferred_mm || total.distortion_mm);
  ASSERT_TRUE(evaluation->total.mesh);
  EXPECT_DOUBLE_EQ(Summarize(evaluation->total.mesh->visible_mm)->mean, 2);
  EXPECT_TRUE(evaluation->frames[0].score.mesh->visible_mm.values().empty()) << "a summary alone is kept";
}

TEST(EvaluationSum, MapsAndCamerasAreOfAllFrames) {
  EvaluationSum sum;
  FrameOutcome first, second;
  first.fields = {{1}, {2}, {3}, {4}, {5}}, second.fields = {{0}, {4}, {5}, {6}, {7}};
  first.cameras = {SampleCamera("c01", 0.25)};
  second.cameras = {SampleCamera("c01", 0.5), SampleCamera("c02", 1)};
  sum.Add(std::move(first)), sum.Add(std::move(second));
  EvaluationInputs inputs;
  inputs.result = "/result", inputs.truth = "/truth", inputs.dump_path = "/dump";
  inputs.fps = 10, inputs.fps_source = "--fps";
  inputs.job.set_id("j-1"), inputs.job.mutable_driven();
  GarmentMesh garment;
  garment.rest.faces = {{0, 1, 2}};
  inputs.garment = std::make_shared<const GarmentMesh>(garment);
  inputs.remarks = {{"measure", "reason"}};
  const auto evaluation = sum.Finish({}, inputs);
  ASSERT_TRUE(evaluation.ok()) << evaluation.status();
  EXPECT_THAT(evaluation->maps.visibility, ElementsAre(0.5));
  EXPECT_THAT(evaluation->maps.error_mm, ElementsAre(3));
  EXPECT_THAT(evaluation->maps.distortion_mm, ElementsAre(4));
  EXPECT_THAT(evaluation->maps.texture_drift, ElementsAre(50)) << "per second";
  EXPECT_THAT(evaluation->maps.true_drift, ElementsAre(60));
  ASSERT_EQ(evaluation->cameras.size(), 2u);
  EXPECT_EQ(evaluation->cameras[0].observations, 80);
  EXPECT_EQ(evaluation->cameras[1].observations, 40);
  EXPECT_EQ(evaluation->result, "/result");
  EXPECT_EQ(evaluation->truth, "/truth");
  EXPECT_EQ(evaluation->dump, "/dump");
  EXPECT_EQ(evaluation->job_id, "j-1");
  EXPECT_TRUE(evaluation->is_driven);
  EXPECT_EQ(evaluation->fps, 10);
  EXPECT_EQ(evaluation->fps_source, "--fps");
  EXPECT_EQ(evaluation->shape.faces.size(), 1u);
  EXPECT_EQ(evaluation->remarks[0].metric, "measure");
  EXPECT_EQ(evaluation->verdict.checks(0).id(), "evaluate.frames");
}

TEST(EvaluationSum, WithoutAFrameRateDriftIsPerFrame) {
  EvaluationSum sum;
  FrameOutcome outcome;
  outcome.fields.true_drift_mm = {5};
  sum.Add(std::move(outcome));
  EXPECT_THAT(sum.Finish({}, {})->maps.true_drift, ElementsAre(5));
}

TEST(EvaluationSum, AResultWithoutAnyFileIsNotFound) {
  FrameOutcome empty;
  empty.frame.missing = {"observations.csv", "cloud.ply", "mesh.ply"};
  EvaluationRequest request;
  request.result = "/result";
  const std::string begin =
                        "/result: holds no observations.csv, cloud.ply or mesh.ply of any of the 2 frames",
                    end = "; give the --out folder of `weft register`";
  for (const char* truth : {"", "/truth"}) {
    EvaluationSum sum;
    sum.Add(empty), sum.Add(empty);
    EvaluationInputs inputs;
    inputs.truth = truth;
    const absl::Status status = sum.Finish(request, inputs).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
    EXPECT_EQ(status.message(), begin + (*truth == 0 ? "" : " of /truth") + end);
  }
  EvaluationSum some;
  some.Add(empty);
  empty.frame.missing.pop_back();
  some.Add(empty);
  EXPECT_TRUE(some.Finish(request, {}).ok());
}

class NoFrames : public FrameSource {
 public:
  const std::vector<std::string>& frame_names() const override { return none_; }
  absl::StatusOr<FrameSet> Read(size_t) const override { return absl::OutOfRangeError("none"); }
  absl::StatusOr<Frame> ReadView(size_t, size_t) const override { return absl::OutOfRangeError("none"); }
  absl::StatusOr<std::string> Fingerprint(size_t) const override { return absl::OutOfRangeError("none"); }
  const std::vector<std::string>& warnings() const override { return none_; }

 private:
  std::vector<std::string> none_;
};

// Remarks of an evaluation with these inputs and totals.
std::vector<std::string> Gaps(const EvaluationRequest& request, bool rig, bool garment, bool printed,
                              bool dump, const FrameOutcome& outcome) {
  EvaluationInputs inputs;
  if (rig) inputs.rig.emplace();
  if (garment) inputs.garment = std::make_shared<const GarmentMesh>();
  if (printed) inputs.printed = std::make_shared<const Template>();
  if (dump) inputs.dump = std::make_unique<NoFrames>(), inputs.truth = "/truth";
  EvaluationSum sum;
  sum.Add(outcome);
  const auto evaluation = sum.Finish(request, inputs);
  std::vector<std::string> remarks;
  for (const EvaluationRemark& remark : evaluation->remarks)
    remarks.push_back(remark.metric + ": " + remark.reason);
  return remarks;
}

TEST(EvaluationSum, GapsAreExplained) {
  FrameOutcome none, all, only_mesh;
  all.frame.metrics = SampleMetrics(), all.frame.score = SampleScore();
  only_mesh.frame.metrics.self_intersections = 0;
  const std::string jitter =
      "jitter: no three consecutive frames have a mesh with the states of its vertices";
  EvaluationRequest request;
  EXPECT_THAT(Gaps(request, false, false, false, false, none), ElementsAre(jitter));
  EXPECT_THAT(Gaps(request, true, true, true, true, all), testing::IsEmpty());
  EXPECT_THAT(
      Gaps(request, true, true, true, true, none),
      ElementsAre(
          "reprojection, leave-one-camera-out: there is no observations.csv; register with "
          "--observations",
          "coverage, visibility: no mesh.ply has the states of its vertices", jitter,
          "texture drift: no two consecutive frames have a mesh and pictures that show the same cells",
          "exact drift: no two consecutive frames have a mesh"));
  const std::string no_board =
      "coverage, visibility, texture drift: no board was printed on the garment, so no "
      "cells tell";
  EXPECT_THAT(Gaps(request, false, true, false, false, none), ElementsAre(no_board, jitter));
  EXPECT_THAT(
      Gaps(request, false, true, false, true, only_mesh),
      ElementsAre(
          no_board, jitter,
          "vertex error, exact drift: the result's mesh has other vertices than the truth's, and only "
          "templates relate them: give --template, and keep the take's template beside its truth"));
  EXPECT_THAT(Gaps(request, false, false, false, false, only_mesh), ElementsAre(jitter));
  request.quick = true;
  EXPECT_THAT(Gaps(request, true, true, true, true, all),
              ElementsAre("geodesic distortion, texture drift: left out on request (--quick)"));
}

TEST(EvaluateJobProgress, EachFrameIsCountedOnce) {
  const TempFolder folder;
  for (int f = 0; f < 6; ++f) {
    const std::string path = folder / absl::StrCat("00", f, "/mesh.ply");
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    ASSERT_TRUE(WriteMesh(path, {{{0, 0, 0}, {9, 0, 0}, {0, 9, double(f)}}, {{0, 1, 2}}}).ok());
  }
  EvaluationRequest request;
  request.result = folder.path();
  std::vector<std::string> calls;
  tbb::task_arena alone(1);  // so that there are several batches
  const auto evaluation = alone.execute([&] {
    return EvaluateJob(request,
                       [&](size_t done, size_t all) { calls.push_back(absl::StrCat(done, "/", all)); });
  });
  ASSERT_TRUE(evaluation.ok()) << evaluation.status();
  EXPECT_THAT(calls, ElementsAre("1/6", "2/6", "3/6", "4/6", "5/6", "6/6"));
  ASSERT_EQ(evaluation->frames.size(), 6u);
  EXPECT_EQ(evaluation->frames[5].frame, "005");
}

TEST_F(EvaluateJobTest, CamerasAreComparedWithThePoints) {
  EvaluationRequest request;
  request.result = folder_ / "result", request.truth = folder_ / "take/truth";
  request.rig = folder_ / "take/rig.json";
  const auto rig = ReadRig(request.rig);
  ASSERT_TRUE(rig.ok()) << rig.status();
  const auto evaluation = EvaluateJob(request);
  ASSERT_TRUE(evaluation.ok()) << evaluation.status();
  ASSERT_EQ(evaluation->cameras.size(), rig->cameras.size());
  int64_t observations = 0;
  for (size_t c = 0; c < rig->cameras.size(); ++c) {
    EXPECT_EQ(evaluation->cameras[c].camera_id, rig->cameras[c].id);
    observations += evaluation->cameras[c].observations;
  }
  const FrameMetrics& total = evaluation->total_metrics;
  ASSERT_TRUE(total.reprojection_px && total.left_out_px);
  EXPECT_EQ(total.reprojection_px->count, observations) << "all agree";
  EXPECT_GT(observations, 1000);
  EXPECT_LT(total.reprojection_px->max, 0.01);
  EXPECT_GT(total.left_out_px->count, 500);
  EXPECT_LT(total.left_out_px->max, 0.05);

  Rig less = *rig;
  const std::string gone = less.cameras.back().id;
  less.cameras.pop_back();
  request.rig = folder_ / "less.json";
  ASSERT_TRUE(WriteRig(request.rig, less).ok());
  const absl::Status refused = EvaluateJob(request).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(refused.message(),
            request.result + "/0000/observations.csv: camera " + gone + " is not in the rig");
}

}  // namespace
}  // namespace weft
