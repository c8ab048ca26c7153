#include "services/results/export/export_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/results/export/small_result.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::FrameReport FailedReport(const std::string& reason) {
  v1::FrameReport report;
  report.set_state(v1::FRAME_STATE_FAILED);
  report.set_reason(reason);
  return report;
}

TEST(ExportSourceTest, AFolderWithoutAJobIsNotFound) {
  SmallResult result;
  result.request.result = result.folder / "elsewhere";
  const absl::Status status = ExportSource::Open(result.request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.message(), AllOf(HasSubstr(result.folder / "elsewhere/job.json"),
                                      HasSubstr("give the --out folder of `weft register`")));
}

TEST(ExportSourceTest, AJobThatFailedIsExportedOnRequestAlone) {
  SmallResult result;
  v1::Job job;
  job.set_state(v1::JOB_STATE_FAILED);
  job.set_message("the disk is full");
  result.WriteJob(job);
  const absl::Status status = ExportSource::Open(result.request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(),
              AllOf(HasSubstr("failed (the disk is full)"), HasSubstr("--allow-unfinished")));
  result.request.allow_unfinished = true;
  const auto source = ExportSource::Open(result.request);
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_THAT(source->notes(), Contains("The job failed (the disk is full)."));
}

TEST(ExportSourceTest, AJobThatRunsTellsHowFarItIs) {
  SmallResult result;
  v1::Job job;
  job.set_state(v1::JOB_STATE_RUNNING);
  job.mutable_frames()->set_done(3);
  job.mutable_frames()->set_degraded(2);
  job.mutable_frames()->set_total(9);
  result.WriteJob(job);
  EXPECT_THAT(ExportSource::Open(result.request).status().message(), HasSubstr("(5 of 9 frames are done)"));
}

TEST(ExportSourceTest, FramesHaveTheirPlaceInTimeAlsoBehindAGap) {
  SmallResult result;
  result.WriteReport(1, FailedReport("too dark"));
  const auto source = ExportSource::Open(result.request);
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_EQ(source->frames().size(), 3u);
  EXPECT_THAT(source->meshes(), ElementsAre(0, 2));
  EXPECT_EQ(source->frames()[1].missing_because(), "too dark");
  EXPECT_EQ(source->frames()[1].repeats(), "");
  EXPECT_EQ(source->frames()[2].index(), 2);
  EXPECT_DOUBLE_EQ(source->frames()[2].time_s(), 0.2);
  EXPECT_EQ(source->fps_source(), "--fps");
  EXPECT_THAT(source->notes(), Contains("Frame 0001 has no mesh: too dark."));
}

TEST(ExportSourceTest, FramesThatLostTheirReportAreGapsToo) {
  SmallResult result;
  std::filesystem::remove(result.FolderOf(1) + "/report.json");
  for (const bool is_damaged : {false, true}) {
    if (is_damaged) WriteBytes(result.FolderOf(1) + "/report.json", "{\"frame\":");
    const auto source = ExportSource::Open(result.request);
    ASSERT_TRUE(source.ok()) << source.status();
    EXPECT_THAT(source->meshes(), ElementsAre(0, 2));
    EXPECT_EQ(source->frames()[2].index(), 2);
    EXPECT_THAT(source->notes(),
                Contains("Frame 0001 has no mesh: its report.json is missing, damaged, or of "
                         "other inputs than the job's."));
  }
  // Of a folder that is gone nothing tells where it was.
  std::filesystem::remove_all(result.FolderOf(1));
  v1::Job job;
  job.set_id("job");
  job.set_state(v1::JOB_STATE_DONE);
  for (const int total : {2, 3}) {
    job.mutable_frames()->set_total(total);
    result.WriteJob(job);
    const auto source = ExportSource::Open(result.request);
    ASSERT_TRUE(source.ok()) << source.status();
    EXPECT_THAT(source->notes(), testing::SizeIs(total - 2));
  }
  EXPECT_EQ(
      ExportSource::Open(result.request)->notes().front(),
      "The job had 3 frames, and " + result.request.result +
          " holds 2: the others were lost, and nothing but the take tells where. `weft register` with the "
          "same inputs computes them again.");
}

// Samples of a point cache are equidistant.
TEST(ExportSourceTest, PointCachesRepeatTheMeshBeforeAGap) {
  SmallResult result;
  result.request.format = ExportFormat::kPc2;
  result.WriteReport(1, FailedReport("too dark"));
  const auto source = ExportSource::Open(result.request);
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_EQ(source->frames()[1].repeats(), "0000");
}

TEST(ExportSourceTest, FormatsWithTimesAskForARateThatNothingTells) {
  SmallResult result;
  result.request.fps = 0;
  ASSERT_TRUE(ExportSource::Open(result.request).ok());  // PLY needs none
  result.request.format = ExportFormat::kUsda;
  const absl::Status status = ExportSource::Open(result.request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("--fps: "), HasSubstr("usda has times")));
}

TEST(ExportSourceTest, BoundsHoldAllFramesInUnitAndAxesOfTheExport) {
  SmallResult result;
  result.request.unit = LengthUnit::kCentimetre;
  result.request.up = UpAxis::kZ;
  const auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  // x, y, z from 0 to 100, 50, 20 mm; with z up y is what was -z.
  EXPECT_EQ(source->topology().bounds.min(), Eigen::Vector3f(0, -2, 0));
  EXPECT_EQ(source->topology().bounds.max(), Eigen::Vector3f(10, 0, 5));
}

TEST(ExportSourceTest, OfTwoStatesThatAreAsFrequentTheSmallerIsTheUsualOne) {
  const SmallResult result;
  RegisteredMesh mesh = SmallResult::MeshAt(1);
  mesh.state = {VertexState::kDriven, VertexState::kTwoView, VertexState::kInferred, VertexState::kObserved};
  ASSERT_TRUE(WriteRegisteredMesh(result.MeshFile(1), mesh, SmallResult::Faces()).ok());
  result.WriteReport(2, FailedReport("too dark"));
  const auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_THAT(source->topology().usual_state, ElementsAre(0, 2, 0, 1));
  EXPECT_THAT(source->topology().coverage, ElementsAre(0, 1, 0.5F, 1));
}

TEST(ExportSourceTest, SigmaIsInTheExportsUnitAndItsMeanInMillimetres) {
  SmallResult result;
  result.request.unit = LengthUnit::kMetre;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const auto mesh = source->Read(0, ExportSource::Velocities::kLeftOut);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->sigma, ElementsAre(0.0015F, 0.0005F, 0.00025F, 0.00025F));
  EXPECT_THAT(source->topology().mean_sigma_mm, ElementsAre(1.5F, 0.5F, 0.25F, 0.25F));
  EXPECT_TRUE(mesh->velocities.empty());
}

TEST(ExportSourceTest, OneFrameStandsStill) {
  SmallResult result;
  result.request.frames = "0001";
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const auto mesh = source->Read(0, ExportSource::Velocities::kComputed);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->velocities, ::testing::Each(Eigen::Vector3f(0, 0, 0)));
}

TEST(ExportSourceTest, AMeshThatIsNotAsItsReportListsItIsDataLoss) {
  SmallResult result;
  v1::FrameReport report;
  report.set_state(v1::FRAME_STATE_DONE);
  v1::ResultFile& file = *report.add_files();
  file.set_name("mesh.ply");
  file.set_checksum(SmallResult::ChecksumOf(result.MeshFile(2)));
  result.WriteReport(2, report);
  EXPECT_TRUE(result.Source().ok());
  result.WriteReport(1, report);
  const absl::Status status = result.Source().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr(result.MeshFile(1)));
}

TEST(ExportSourceTest, AMeshThatChangesMeanwhileIsDataLoss) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  RegisteredMesh fewer = SmallResult::MeshAt(1);
  fewer.vertices_mm.pop_back(), fewer.state.pop_back(), fewer.sigma_mm.pop_back(), fewer.views.pop_back();
  ASSERT_TRUE(WriteRegisteredMesh(result.MeshFile(1), fewer, {{0, 1, 2}}).ok());
  const absl::Status status = source->Read(1, ExportSource::Velocities::kLeftOut).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), AllOf(HasSubstr(result.MeshFile(1)), HasSubstr("export again")));
}

TEST(ExportSourceTest, AStopEndsTheSurvey) {
  const SmallResult result;
  auto source = ExportSource::Open(result.request);
  ASSERT_TRUE(source.ok()) << source.status();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(source->Survey(nullptr, stop.get_token()).code(), absl::StatusCode::kCancelled);
}

TEST(ExportSourceTest, TheWorldsMeshIsInMillimetresWhateverIsExported) {
  SmallResult result;
  result.request.unit = LengthUnit::kMetre;
  result.request.up = UpAxis::kZ;
  const auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  ExportSource world = source->InWorldMm();
  const auto mesh = world.Read(2, ExportSource::Velocities::kLeftOut);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->positions, ElementsAre(Eigen::Vector3f(0, 0, 20), Eigen::Vector3f(100, 0, 20),
                                           Eigen::Vector3f(100, 50, 20), Eigen::Vector3f(0, 50, 20)));
}

TEST(ExportSourceTest, FramesWhoseReportListsNoMeshHaveNone) {
  SmallResult result;
  v1::FrameReport report;
  report.set_state(v1::FRAME_STATE_DONE);
  report.add_files()->set_name("cloud.ply");
  result.WriteReport(1, report);
  const auto source = ExportSource::Open(result.request);
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_EQ(source->frames()[1].missing_because(), "it has no mesh garment");
}

TEST(ExportSourceTest, ResultsThatCannotBeReadAreNamed) {
  SmallResult result;
  WriteBytes(result.folder / "result/job.json", "{");
  EXPECT_THAT(ExportSource::Open(result.request).status().message(), HasSubstr("result/job.json"));
  v1::Job job;
  job.set_state(v1::JOB_STATE_DONE);
  result.WriteJob(job);
  for (int frame = 0; frame < SmallResult::kFrames; ++frame)
    std::filesystem::remove_all(result.FolderOf(frame));
  EXPECT_EQ(ExportSource::Open(result.request).status(),
            absl::FailedPreconditionError(result.request.result +
                                          ": holds no frames of its job; register the take first"));
}

TEST(ExportSourceTest, BridgedFramesAreTold) {
  SmallResult result;
  v1::FrameReport report = FailedReport("too dark");
  report.mutable_temporal()->set_bridged(true);
  result.WriteReport(1, report);
  const auto source = ExportSource::Open(result.request);
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_THAT(source->meshes(), ElementsAre(0, 1, 2));
  EXPECT_THAT(source->notes(),
              ElementsAre("Frame 0001 failed and is bridged: its mesh comes from the frames around it."));
}

TEST(ExportSourceTest, TimesOfThePicturesGiveTheRate) {
  SmallResult result;
  v1::Job job;
  job.set_state(v1::JOB_STATE_DONE);
  job.mutable_spec()->set_dump(result.folder / "take");
  result.WriteJob(job);
  WriteBytes(result.folder / "take/truth/pictures.csv",
             "frame,camera,mid_exposure_ns,lost\n0000,a,0,0\n0001,a,40000000,0\n");
  result.request.fps = 0;
  const auto source = ExportSource::Open(result.request);
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_EQ(source->fps(), 25);
  EXPECT_EQ(source->fps_source(), "the times in " + result.folder / "take/truth/pictures.csv");
  EXPECT_DOUBLE_EQ(source->frames()[2].time_s(), 0.08);
}

}  // namespace
}  // namespace weft
