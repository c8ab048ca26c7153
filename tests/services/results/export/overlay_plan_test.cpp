#include "services/results/export/overlay_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/results/export/filmed_result.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(OverlayPlanTest, MeshesAreDrawnInTheRigsWorldAndMillimetres) {
  const ExportRequest request = InTheWorld({.result = "result", .out = "out", .frames = "3:5"});
  EXPECT_EQ(request.result, "result");
  EXPECT_EQ(request.out, "out");
  EXPECT_EQ(request.frames, "3:5");
  const auto transform = ExportTransform::Make(*request.up, request.world_up, *request.unit);
  ASSERT_TRUE(transform.ok()) << transform.status();
  EXPECT_EQ(transform->Position({1, 2, 3}), Eigen::Vector3f(1, 2, 3));
}

TEST(OverlayPlanTest, TakesAllCamerasOrThoseThatAreNamedInTheirOrder) {
  FilmedResult filmed;
  auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const auto all = PlanOverlays(filmed.recording, *source);
  ASSERT_TRUE(all.ok()) << all.status();
  EXPECT_THAT(all->cameras, ElementsAre(0, 1));
  EXPECT_THAT(all->index_of_frame,
              ElementsAre(std::pair("0000", 0), std::pair("0001", 1), std::pair("0002", 2)));
  EXPECT_EQ(all->rig.ContentHash(), filmed.rig.ContentHash());
  EXPECT_EQ(all->sigma_range_mm.low, 0);
  EXPECT_GE(all->sigma_range_mm.high, 1.5);  // the largest of the mesh
  filmed.recording.cameras = {"c2", "c1"};
  EXPECT_THAT(PlanOverlays(filmed.recording, *source)->cameras, ElementsAre(1, 0));
}

TEST(OverlayPlanTest, NamesTheCamerasThatTheRigHas) {
  FilmedResult filmed;
  filmed.recording.cameras = {"c1", "c3"};
  auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const absl::Status status = PlanOverlays(filmed.recording, *source).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message(), "--camera: the rig has no camera c3; it has c1, c2");
}

TEST(OverlayPlanTest, RefusesARigThatIsNotTheJobs) {
  const FilmedResult filmed;
  v1::Job job;
  job.set_state(v1::JOB_STATE_DONE);
  job.mutable_inputs()->set_rig("0123456789abcdef");
  filmed.WriteJob(job);
  auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const absl::Status status = PlanOverlays(filmed.recording, *source).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(), AllOf(HasSubstr(filmed.recording.rig), HasSubstr("0123456789abcdef"),
                                      HasSubstr("give the rig of the job with --rig")));
}

TEST(OverlayPlanTest, TakesRecordingAndRigOfTheJobWhereNoneIsGiven) {
  const FilmedResult filmed;
  v1::Job job;
  job.set_state(v1::JOB_STATE_DONE);
  job.mutable_spec()->set_dump(filmed.recording.dump);
  job.mutable_spec()->set_rig(filmed.recording.rig);
  job.mutable_inputs()->set_rig(filmed.rig.ContentHash());
  filmed.WriteJob(job);
  auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const auto plan = PlanOverlays({}, *source);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->dump->frame_names().size(), 3u);
}

// Jobs of earlier versions have paths as they were typed.
TEST(OverlayPlanTest, APathOfTheJobThatIsElsewhereAsksForTheOptions) {
  const FilmedResult filmed;
  v1::Job job;
  job.set_state(v1::JOB_STATE_DONE);
  job.mutable_spec()->set_rig("no such folder/rig.json");
  filmed.WriteJob(job);
  auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const absl::Status status =
      PlanOverlays({.dump = filmed.recording.dump, .rig = "", .cameras = {}}, *source).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.message(),
              AllOf(HasSubstr("no such folder/rig.json"), HasSubstr("give --take and --rig")));
}

TEST(OverlayPlanTest, ARecordingThatLacksAFrameIsNamedWithIt) {
  const FilmedResult filmed;
  std::filesystem::remove_all(filmed.folder / "dump/0001");
  auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const absl::Status status = PlanOverlays(filmed.recording, *source).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.message(),
              AllOf(HasSubstr(filmed.recording.dump), HasSubstr("has no frame 0001"), HasSubstr("--take")));
}

TEST(OverlayPlanTest, VerticesHaveTheColoursOfWhatIsShown) {
  const FilmedResult filmed;
  auto source = filmed.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const auto plan = PlanOverlays(filmed.recording, *source);
  ASSERT_TRUE(plan.ok()) << plan.status();
  const auto state = ReadOverlayMesh(OverlayKind::kState, *plan, *source, 1);
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_EQ(state->vertices_mm, SmallResult::MeshAt(1).vertices_mm);
  EXPECT_EQ(state->faces, SmallResult::Faces());
  EXPECT_THAT(state->colors,
              ElementsAre(StateColor(VertexState::kInferred), StateColor(VertexState::kTwoView),
                          StateColor(VertexState::kObserved), StateColor(VertexState::kObserved)));
  EXPECT_THAT(ReadOverlayMesh(OverlayKind::kWireframe, *plan, *source, 1)->colors,
              Each(Eigen::Vector3f(0, 1, 1)));
  const auto sigma = ReadOverlayMesh(OverlayKind::kSigma, *plan, *source, 1);
  ASSERT_TRUE(sigma.ok()) << sigma.status();
  EXPECT_EQ(sigma->colors[2], MapColor(0.25 / plan->sigma_range_mm.high));
  EXPECT_EQ(sigma->colors[2], sigma->colors[3]);
  EXPECT_NE(sigma->colors[0], sigma->colors[2]);
}

}  // namespace
}  // namespace weft
