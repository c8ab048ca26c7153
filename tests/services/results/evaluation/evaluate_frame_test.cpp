#include "services/results/evaluation/evaluate_frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/formats/files/observations_file.h"
#include "tests/services/results/evaluation/sheet_on_disk.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kNear = 1e-4;  // coordinates are of single precision

std::string FrameName(int frame) { return absl::StrCat("000", frame); }

// In each row three observed cells, one of two views and four that are inferred; the hem is observed.
VertexState StateOf(size_t vertex) {
  if (vertex >= SheetOnDisk::kCells || vertex % 8 < 3) return VertexState::kObserved;
  return vertex % 8 == 3 ? VertexState::kTwoView : VertexState::kInferred;
}

class EvaluateFrameTest : public testing::Test {
 protected:
  // The sheet moves by 3 f^2 mm along z. Measured vertices are off by 0.5 f^2 mm along x, all others by twice
  // that.
  void WriteFrames(int frames) {
    for (size_t v = 0; v < sheet_.rest().size(); ++v) states_.push_back(StateOf(v));
    for (int f = 0; f < frames; ++f) {
      const SheetOnDisk::Positions truth_mm = SheetOnDisk::Moved(sheet_.rest(), {0, 0, 3.0 * f * f});
      SheetOnDisk::Positions mesh_mm = truth_mm;
      for (size_t v = 0; v < mesh_mm.size(); ++v)
        mesh_mm[v].x() += (states_[v] == VertexState::kInferred ? 1 : 0.5) * f * f;
      sheet_.WriteTruth(FrameName(f), truth_mm);
      sheet_.WriteResultMesh(FrameName(f), mesh_mm, states_);
    }
  }

  absl::StatusOr<FrameOutcome> Evaluate(size_t index) {
    const auto inputs = LoadEvaluationInputs(request_);
    if (!inputs.ok()) return inputs.status();
    const auto tools = PrepareTools(request_, *inputs);
    if (!tools.ok()) return tools.status();
    return EvaluateFrame(request_, *inputs, *tools, index);
  }
  FrameOutcome Evaluated(size_t index) {
    auto outcome = Evaluate(index);
    EXPECT_TRUE(outcome.ok()) << outcome.status();
    return outcome.ok() ? *std::move(outcome) : FrameOutcome();
  }

  static void ExpectErrors(const std::optional<ErrorSummary>& errors, size_t count, double mean, double max) {
    ASSERT_TRUE(errors);
    EXPECT_EQ(errors->count, static_cast<int64_t>(count));
    EXPECT_NEAR(errors->mean, mean, kNear);
    EXPECT_NEAR(errors->max, max, kNear);
  }

  SheetOnDisk sheet_;
  EvaluationRequest request_ = sheet_.Request();
  std::vector<VertexState> states_;
};

TEST_F(EvaluateFrameTest, MotionIsThatOfTheWrittenMeshes) {
  WriteFrames(4);
  request_.fps = 10;
  const FrameOutcome outcome = Evaluated(1);
  EXPECT_EQ(outcome.frame.frame, "0001");
  EXPECT_THAT(outcome.frame.missing, ElementsAre("observations.csv", "cloud.ply"));
  const size_t all = sheet_.rest().size(), measured = all - 32;
  const FrameMetrics& m = outcome.frame.metrics;
  EXPECT_EQ(m.coverage, 0.375);
  EXPECT_EQ(m.two_view_share, 0.125);
  EXPECT_EQ(m.self_intersections, 0);
  ExpectErrors(m.jitter_observed_mm, measured, std::hypot(6, 1), std::hypot(6, 1));
  ExpectErrors(m.jitter_inferred_mm, 32, std::hypot(6, 2), std::hypot(6, 2));
  ExpectErrors(m.jitter_of_truth_mm, all, 6, 6);
  ExpectErrors(m.error_jitter_observed_mm, measured, 1, 1);
  ExpectErrors(m.error_jitter_inferred_mm, 32, 2, 2);
  ExpectErrors(m.error_change_mm, 32, 2.25, 3);
  ExpectErrors(m.error_change_mm_s, 32, 22.5, 30);
  ExpectErrors(m.true_drift_observed_mm, measured, 1.5, 1.5);
  ExpectErrors(m.true_drift_inferred_mm, 32, 3, 3);
  ExpectErrors(m.true_drift_observed_mm_s, measured, 15, 15);
  ExpectErrors(m.true_drift_inferred_mm_s, 32, 30, 30);
  EXPECT_NEAR(m.error_change_mm_s->median, 10 * m.error_change_mm->median, 1e-9);
  EXPECT_NEAR(m.error_change_mm_s->p95, 10 * m.error_change_mm->p95, 1e-9);
  EXPECT_NEAR(m.error_change_mm_s->p99, 10 * m.error_change_mm->p99, 1e-9);
  EXPECT_FALSE(m.distortion_mm || m.texture_drift_mm || m.reprojection_px);
  ASSERT_TRUE(outcome.frame.score.mesh);
  ExpectErrors(Summarize(outcome.frame.score.mesh->visible_mm), 32, 0.75, 1);

  const VertexFields& fields = outcome.fields;
  ASSERT_EQ(fields.observed.size(), all);
  EXPECT_EQ(fields.observed[0], 1);
  EXPECT_EQ(fields.observed[3], 0);
  EXPECT_EQ(fields.observed[7], 0);
  EXPECT_TRUE(std::isnan(fields.observed[SheetOnDisk::kCells]));
  ASSERT_EQ(fields.error_mm.size(), all);
  EXPECT_NEAR(fields.error_mm[0], 0.5, kNear);
  EXPECT_NEAR(fields.error_mm[7], 1, kNear);
  ASSERT_EQ(fields.true_drift_mm.size(), all);
  EXPECT_NEAR(fields.true_drift_mm[0], 1.5, kNear);
  EXPECT_NEAR(fields.true_drift_mm[7], 3, kNear);
}

TEST_F(EvaluateFrameTest, TheFirstAndTheLastFrameHaveNeighboursOnOneSide) {
  WriteFrames(3);
  const FrameMetrics first = Evaluated(0).frame.metrics, last = Evaluated(2).frame.metrics;
  EXPECT_FALSE(first.jitter_observed_mm || first.jitter_of_truth_mm || first.error_jitter_observed_mm);
  ExpectErrors(first.error_change_mm, 32, 0.75, 1);
  EXPECT_TRUE(first.true_drift_observed_mm);
  EXPECT_FALSE(first.true_drift_observed_mm_s || first.error_change_mm_s) << "the frame rate is not known";
  EXPECT_FALSE(last.error_change_mm || last.jitter_observed_mm);
  EXPECT_TRUE(last.coverage);
}

TEST_F(EvaluateFrameTest, FramesBesideAGapHaveNoNeighbourThere) {
  WriteFrames(5);
  std::filesystem::remove_all(sheet_.folder / "result/0002");
  EXPECT_FALSE(Evaluated(1).frame.metrics.error_change_mm);
  std::filesystem::remove_all(sheet_.folder / "take/truth/0002");
  EXPECT_FALSE(Evaluated(1).frame.metrics.error_change_mm) << "0003 is not the next one";
  const FrameMetrics after = Evaluated(2).frame.metrics;
  EXPECT_TRUE(after.error_change_mm);
  EXPECT_FALSE(after.jitter_observed_mm);
}

TEST_F(EvaluateFrameTest, WithoutStatesAllVerticesAreOneKind) {
  WriteFrames(3);
  for (int f = 0; f < 3; ++f)
    sheet_.WriteResultMesh(FrameName(f), SheetOnDisk::Moved(sheet_.rest(), {0.5 * f * f, 0, 3.0 * f * f}),
                           {});
  const FrameMetrics m = Evaluated(1).frame.metrics;
  const size_t all = sheet_.rest().size();
  EXPECT_FALSE(m.coverage || m.two_view_share);
  EXPECT_FALSE(m.jitter_observed_mm || m.jitter_inferred_mm);
  ExpectErrors(m.error_jitter_observed_mm, all, 1, 1);
  EXPECT_FALSE(m.error_jitter_inferred_mm || m.true_drift_inferred_mm);
  ExpectErrors(m.true_drift_observed_mm, all, 1.5, 1.5);
}

TEST_F(EvaluateFrameTest, WithoutATruthThereIsJitterAlone) {
  WriteFrames(3);
  request_.truth.clear();
  const FrameOutcome outcome = Evaluated(1);
  EXPECT_TRUE(outcome.frame.metrics.jitter_inferred_mm);
  EXPECT_FALSE(outcome.frame.metrics.error_change_mm || outcome.frame.metrics.jitter_of_truth_mm);
  EXPECT_TRUE(outcome.fields.error_mm.empty() && outcome.fields.true_drift_mm.empty());
  EXPECT_FALSE(outcome.frame.score.mesh);
}

TEST_F(EvaluateFrameTest, DistortionIsMeasuredAtFramesSpreadEvenly) {
  for (int f = 0; f < 5; ++f) {
    SheetOnDisk::Positions larger_mm = sheet_.rest();
    for (Eigen::Vector3d& position : larger_mm) position *= 1.1;
    sheet_.WriteResultMesh(FrameName(f), larger_mm, {});
  }
  request_.truth.clear();
  request_.quick = false;
  const auto inputs = LoadEvaluationInputs(request_);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  const auto measured = [&](int samples) {
    request_.samples = samples;
    const auto tools = PrepareTools(request_, *inputs);
    EXPECT_TRUE(tools.ok()) << tools.status();
    std::string frames;
    for (size_t f = 0; f < 5; ++f) {
      const auto outcome = EvaluateFrame(request_, *inputs, *tools, f);
      EXPECT_TRUE(outcome.ok()) << outcome.status();
      const FrameMetrics& m = outcome->frame.metrics;
      if (!m.distortion_relative) continue;
      absl::StrAppend(&frames, f);
      EXPECT_NEAR(*m.distortion_relative, 0.1, kNear);
      EXPECT_GT(*m.distortion_mm, 2);
      EXPECT_EQ(outcome->fields.distortion_mm.size(), sheet_.rest().size());
    }
    return frames;
  };
  EXPECT_EQ(measured(1), "2");
  EXPECT_EQ(measured(2), "13");
  EXPECT_EQ(measured(4), "0134");
  EXPECT_EQ(measured(5), "01234");
  EXPECT_EQ(measured(0), "01234");
  request_.quick = true;
  EXPECT_EQ(measured(0), "");
}

TEST_F(EvaluateFrameTest, FacesThatIntersectAreCounted) {
  WriteBytes(sheet_.folder / "crossing.obj",
             "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 30 30 -50\nv 30 30 50\nv 60 60 50\nf 1 2 3\nf 4 5 6\n");
  const SheetOnDisk::Positions crossing_mm = {{0, 0, 0},     {100, 0, 0},  {0, 100, 0},
                                              {30, 30, -50}, {30, 30, 50}, {60, 60, 50}};
  sheet_.WriteMeshWithFaces("0000", crossing_mm, {}, {{0, 1, 2}, {3, 4, 5}});
  request_.truth.clear(), request_.garment = sheet_.folder / "crossing.obj";
  EXPECT_EQ(Evaluated(0).frame.metrics.self_intersections, 1);
}

TEST_F(EvaluateFrameTest, MeshesOfOtherSizesAreNamed) {
  WriteFrames(2);
  sheet_.WriteMeshWithFaces("0001", {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}}, {}, {{0, 1, 2}});
  const std::string all = absl::StrCat(sheet_.rest().size());
  const std::string path = sheet_.folder / "result/0001/mesh.ply";
  for (const size_t frame : {0, 1}) {
    const auto refused = Evaluate(frame);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(refused.status().message(),
              path + ": has 3 vertices, the template " + all + "; they do not belong together");
  }
  request_.garment.clear(), request_.truth.clear();
  EXPECT_EQ(Evaluate(0).status().message(),
            path + ": has 3 vertices, the template " + all + "; they do not belong together");
  EXPECT_TRUE(Evaluate(1).status().message().find("0000/mesh.ply: has " + all) != std::string::npos);
}

TEST_F(EvaluateFrameTest, AnotherTemplateOfTheBoardIsComparedByItsCells) {
  WriteFrames(3);
  const Template upper = sheet_.Sheet(6);
  ASSERT_TRUE(WriteTemplate(sheet_.folder / "upper", upper).ok());
  for (int f = 0; f < 3; ++f) {
    SheetOnDisk::Positions mesh_mm = upper.rest.vertices_mm;
    for (size_t v = 0; v < 48; ++v) mesh_mm[v] = sheet_.rest()[v] + Eigen::Vector3d(0, 0.25 * f, 3.0 * f * f);
    sheet_.WriteMeshWithFaces(FrameName(f), mesh_mm,
                              std::vector<VertexState>(mesh_mm.size(), VertexState::kObserved),
                              upper.rest.faces);
  }
  request_.garment = sheet_.folder / "upper";
  const auto inputs = LoadEvaluationInputs(request_);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  ASSERT_FALSE(inputs->remarks.empty());
  bool told = false;
  for (const EvaluationRemark& remark : inputs->remarks)
    told |= remark.reason == absl::StrCat("the result's template is not that of ",
                                          sheet_.folder / "take/template",
                                          "; its vertices are compared by board cell, which 48 of ",
                                          upper.rest.vertices_mm.size(), " have in common with the truth");
  EXPECT_TRUE(told);
  const FrameOutcome outcome = Evaluated(1);
  ASSERT_TRUE(outcome.frame.score.mesh);
  ExpectErrors(Summarize(outcome.frame.score.mesh->visible_mm), 32, 0.25, 0.25);
  ExpectErrors(Summarize(outcome.frame.score.mesh->hidden_mm), 16, 0.25, 0.25);
  ExpectErrors(outcome.frame.metrics.error_change_mm, 32, 0.25, 0.25);
  ExpectErrors(outcome.frame.metrics.true_drift_observed_mm, 48, 0.25, 0.25);
  ExpectErrors(outcome.frame.metrics.error_jitter_observed_mm, 48, 0, 0);
}

TEST_F(EvaluateFrameTest, OfSeveralGarmentsTheRowsOfTheResultsOwnCount) {
  WriteFrames(1);
  auto inputs = LoadEvaluationInputs(request_);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  inputs->rows_of_garment = GarmentRows(sheet_.Sheet(4));
  const auto tools = PrepareTools(request_, *inputs);
  ASSERT_TRUE(tools.ok()) << tools.status();
  const auto all = EvaluateFrame(request_, *inputs, *tools, 0);
  ASSERT_TRUE(all.ok()) << all.status();
  EXPECT_EQ(all->frame.score.mesh->visible_mm.size(), 32u);
  request_.scores.well_seen_views = 2;  // of all rows, were they its own
  EXPECT_EQ(EvaluateFrame(request_, *inputs, *tools, 0)->frame.score.mesh->visible_mm.size(), 32u);
  inputs->rows_of_garment.reset();
  EXPECT_EQ(EvaluateFrame(request_, *inputs, *tools, 0)->frame.score.mesh->visible_mm.size(), 64u);
}

TEST_F(EvaluateFrameTest, ObservationsThatTheTruthDoesNotKnowAreNamedWithTheirFrame) {
  WriteFrames(1);
  ASSERT_TRUE(WriteObservations(sheet_.folder / "result/0000/observations.csv",
                                {{"other", {{1, 2, {0, 0}, 0.1F, 1}}}})
                  .ok());
  const absl::Status status = Evaluate(0).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              testing::AllOf(testing::StartsWith(sheet_.folder / "result/0000" + ": "), HasSubstr("other")));
}

}  // namespace
}  // namespace weft
