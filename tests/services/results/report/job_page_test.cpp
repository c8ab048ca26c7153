#include "services/results/report/job_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/results/report/driven_sigma.h"
#include "services/results/report/job_summary.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/report/sample_job.h"

namespace weft {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

v1::JobPage PageOf(const v1::Job& job, const std::vector<v1::FrameReport>& frames) {
  return JobPageOf({.job = job, .frames = frames, .pictures = {}, .notes = {}, .sequence = {}});
}
v1::JobPage PageOf(const std::vector<v1::FrameReport>& frames) { return PageOf(SampleJob(frames), frames); }

TEST(JobPage, GarmentsOfAJointTemplateAreToldApart) {
  std::vector<v1::FrameReport> frames = SampleFrames(2);
  EXPECT_THAT(PageOf(frames).garments(), IsEmpty());
  for (v1::FrameReport& frame : frames) {
    for (const auto& [id, observed] : {std::pair("skirt", 50), std::pair("shirt", 90)}) {
      v1::GarmentReport& garment = *frame.mutable_mesh()->add_garments();
      garment.set_id(id);
      garment.set_vertices(1200);
      garment.set_vertices_with_cell(100);
      garment.set_observed(observed);
      garment.set_coverage(observed / 100.0);
      garment.set_median_observed_sigma_mm(0.2);
    }
    frame.mutable_mesh()->add_overlaps()->set_inner("skirt");
    frame.mutable_mesh()->mutable_overlaps(0)->set_outer("shirt");
  }
  frames[1].mutable_mesh()->mutable_garments(0)->set_coverage(0.3);
  const v1::JobPage page = PageOf(frames);
  EXPECT_EQ(page.garments(0).ShortDebugString(),
            "id: \"skirt\" vertices: 1200 coverage: 0.5 lowest_coverage: 0.3 lowest_coverage_frame: "
            "\"000001\" median_sigma_mm: 0.2");
  EXPECT_EQ(page.overlaps(0).ShortDebugString(), "inner: \"skirt\" outer: \"shirt\" frames: 2");
  EXPECT_THAT(page.remarks(),
              Contains("Of the garments' cells were observed: skirt 50.0\u00a0%, shirt 90.0\u00a0%."));
}

TEST(JobPage, ACameraThatMovedIsAnAlarm) {
  std::vector<v1::FrameReport> frames = SampleFrames(4);
  for (v1::FrameReport& frame : frames) {
    ASSERT_GT(frame.views_size(), 2);
    for (int v = 0; v < frame.views_size(); ++v) {
      v1::CameraBias& bias = *frame.mutable_views(v)->mutable_bias();
      bias.set_observations(4000);
      bias.set_mean_x_px(v == 1 ? 2.3 : v == 2 ? 0.3 : 0.05);
      bias.set_mean_y_px(v == 1 ? -0.4 : 0);
      bias.set_significance(v == 1 ? 45 : 6);
    }
  }
  const v1::JobPage page = PageOf(frames);
  // Camera 2 is pulled along.
  EXPECT_THAT(page.remarks(),
              ElementsAre(HasSubstr("Camera " + frames[0].views(1).camera() +
                                    " moved, or its calibration is off: it sees the cloth 2.33 px (right "
                                    "2.30, down -0.40; 45 sigmas)")));
  EXPECT_EQ(page.job().verdict().grade(), v1::GRADE_USABLE);
  EXPECT_NEAR(page.cameras(1).bias_x_px(), 2.3, 1e-9);
  EXPECT_NEAR(page.cameras(1).bias_y_px(), -0.4, 1e-9);
  EXPECT_EQ(page.cameras(1).bias_significance(), 45);
}

// An avatar drives with cameras too few to observe cells: such jobs have no coverage, and figures of their
// own.
TEST(JobPage, DrivenJobsHaveTheirOwnFigures) {
  std::vector<v1::FrameReport> frames = SampleFrames(3);
  for (v1::FrameReport& frame : frames) {
    frame.clear_cloud();
    v1::DrivenReport& driven = *frame.mutable_driven();
    driven.set_rays(4321);
    driven.set_rejected_rays(21);
    driven.set_residual_px(0.37);
    driven.set_median_sigma_mm(2.25);
    driven.set_memory("what the driver knew");
  }
  v1::Job job = SampleJob(frames);
  job.mutable_driven()->set_avatar("/avatars/shirt");
  const v1::JobPage page = PageOf(job, frames);
  EXPECT_TRUE(page.figures().driven());
  EXPECT_FALSE(std::isfinite(page.figures().coverage()));
  EXPECT_EQ(page.figures().median_rays(), 4300);
  EXPECT_EQ(page.figures().median_residual_px(), 0.37);
  EXPECT_EQ(page.figures().median_sigma_mm(), 2.25);
  EXPECT_EQ(page.headline(), "3 of 3 frames driven.");
  EXPECT_EQ(page.frames(0).driven().memory(), "");
  for (const char* camera : {"front", "back"}) job.mutable_driven()->add_cameras(camera);
  EXPECT_EQ(DrivenSigmaNote(job), "");
  job.mutable_driven()->add_cameras("left");
  EXPECT_THAT(DrivenSigmaNote(job), HasSubstr("too small before 3 cameras"));
  EXPECT_THAT(PageOf(job, frames).remarks(), Contains(DrivenSigmaNote(job)));
}

TEST(JobPage, SaysInWordsWhatCameOut) {
  const std::vector<v1::FrameReport> frames = SampleFrames(12);
  const v1::JobPage page = PageOf(frames);
  int observed = 0;
  for (const v1::FrameReport& frame : frames) observed += frame.mesh().observed();
  EXPECT_EQ(page.headline(),
            absl::StrFormat("12 of 12 frames registered, %.1f\u00a0%% of the cells observed.",
                            100.0 * observed / (12 * kSampleVerticesWithCell)));
  EXPECT_EQ(page.job().verdict().grade(), v1::GRADE_GOOD);
  EXPECT_EQ(page.figures().wall_ms(), 50'000);
  EXPECT_EQ(page.figures().registered(), 12);
  EXPECT_EQ(page.job().inputs().board(), "0f1e2d3c4b5a6978");
  EXPECT_EQ(page.paper(0).drift_mm_s(), 1.5);
}

TEST(JobPage, DegradedAndFailedFramesAreRemarked) {
  std::vector<v1::FrameReport> frames = SampleFrames(6);
  LoseCameras(2, "image has 100 x 100 pixels, the rig says 1280 x 960", frames[1]);
  FailFrame("no cell of the board was decoded in any view", frames[4]);
  FailFrame("worker ended by signal 9", frames[5]);
  const v1::JobPage page = PageOf(frames);
  EXPECT_THAT(page.headline(), HasSubstr("4 of 6 frames registered, "));
  EXPECT_EQ(page.job().verdict().grade(), v1::GRADE_BAD);
  EXPECT_THAT(page.remarks(), Contains("1 frame failed: no cell of the board was decoded in any view"));
  EXPECT_THAT(page.remarks(), Contains("1 frame is degraded: it was registered, with cameras missing."));
  EXPECT_EQ(page.frames(5).reason(), "worker ended by signal 9");
  EXPECT_EQ(page.cameras(0).missing_reasons(0).reason(),
            "image has 100 x 100 pixels, the rig says 1280 x 960");
}

TEST(JobPage, FrequentReasonsComeFirst) {
  std::vector<v1::FrameReport> frames = SampleFrames(5);
  for (int f = 0; f < 5; ++f) LoseCameras(1, f == 0 ? "a broken file" : "no image in the dump", frames[f]);
  const v1::PageCamera camera = PageOf(frames).cameras(0);
  ASSERT_EQ(camera.missing_reasons_size(), 2);
  EXPECT_EQ(camera.missing_reasons(0).reason(), "no image in the dump");
  EXPECT_EQ(camera.missing_reasons(0).count(), 4);
  EXPECT_EQ(camera.frames_missing(), 5);
}

TEST(JobPage, EveryStateOfAJobHasItsHeadline) {
  const std::vector<v1::FrameReport> frames = SampleFrames(2);
  v1::Job job = SampleJob(frames);
  job.mutable_frames()->set_total(5);
  job.mutable_frames()->set_cancelled(3);
  const auto in_state = [&](v1::JobState state) {
    job.set_state(state);
    return PageOf(job, frames);
  };
  EXPECT_THAT(in_state(v1::JOB_STATE_CANCELLED).headline(),
              HasSubstr("Cancelled: 2 of 5 frames registered, "));
  EXPECT_THAT(in_state(v1::JOB_STATE_CANCELLED).remarks(), Contains("3 frames were not computed."));
  EXPECT_TRUE(in_state(v1::JOB_STATE_CANCELLED).job().has_verdict());
  EXPECT_THAT(in_state(v1::JOB_STATE_RUNNING).headline(),
              HasSubstr("Still running: 2 of 5 frames registered, "));
  EXPECT_FALSE(in_state(v1::JOB_STATE_RUNNING).job().has_verdict());
  EXPECT_THAT(in_state(v1::JOB_STATE_QUEUED).headline(), HasSubstr("Waiting to start: "));
  EXPECT_THAT(in_state(v1::JOB_STATE_FAILED).headline(),
              HasSubstr("The job failed: 2 of 5 frames registered, "));
  EXPECT_TRUE(in_state(v1::JOB_STATE_UNSPECIFIED).job().has_verdict());
}

TEST(JobPage, BridgedFramesAreRemarked) {
  v1::FrameReport bridged = SampleFrame(1);
  FailFrame("no cell of the board was decoded in any view", bridged);
  bridged.mutable_temporal()->set_bridged(true);
  const v1::JobPage page = PageOf({SampleFrame(0), bridged});
  EXPECT_THAT(page.remarks(), Contains(HasSubstr("1 of them is bridged")));
  EXPECT_TRUE(page.frames(1).temporal().bridged());
}

TEST(JobPage, JobWithoutAnyFrameStillHasAReport) {
  v1::Job job;
  job.set_state(v1::JOB_STATE_FAILED);
  job.set_message("rig.json: camera 7 is named twice");
  job.mutable_frames()->set_total(8);
  const v1::JobPage page = PageOf(job, {});
  EXPECT_EQ(page.headline(), "The job failed: No frame was registered.");
  EXPECT_THAT(page.remarks(), Contains("rig.json: camera 7 is named twice"));
  EXPECT_THAT(page.frames(), IsEmpty());
  EXPECT_FALSE(page.has_sequence());
}

TEST(JobPage, SumsUpResidualsOfCamerasAndNamesEveryVersionOnce) {
  std::vector<v1::FrameReport> frames = SampleFrames(2, 3);
  for (int f = 0; f < 2; ++f) {
    v1::CameraBias& bias = *frames[f].mutable_views(1)->mutable_bias();
    bias.set_observations(f == 0 ? 300 : 100);
    bias.set_rms_px(f == 0 ? 0.1 : 0.3);
    v1::StageKey& key = *frames[f].add_keys();
    key.set_stage("second_pass");
    key.set_version(2);
    frames[f].add_keys()->set_stage("align");  // switched off
  }
  const v1::JobPage page = PageOf(frames);
  EXPECT_NEAR(page.cameras(1).residual_px(), std::sqrt((300 * 0.01 + 100 * 0.09) / 400), 1e-9);
  EXPECT_TRUE(std::isnan(page.cameras(0).residual_px()));
  EXPECT_THAT(page.algorithms(), ElementsAre("second pass 2"));
}

// A page of thousands of frames is no larger than its meshes make it.
TEST(JobPage, FramesHoldWhatThePageShows) {
  std::vector<v1::FrameReport> frames = SampleFrames(1000, 211);
  frames[0].add_files()->set_name("mesh.ply");
  frames[0].mutable_options()->set_preset("best");
  const v1::JobPage page = PageOf(frames);
  EXPECT_THAT(page.frames(0).views(), IsEmpty());
  EXPECT_THAT(page.frames(0).files(), IsEmpty());
  EXPECT_FALSE(page.frames(0).has_options());
  EXPECT_LT(page.ByteSizeLong(), 1u << 20);
}

// Pages are handed on; who asked for the job, and where its logs are, is nobody's business.
TEST(JobPage, TheJobKeepsWhatItsPageShows) {
  v1::Job job = SampleJob({});
  job.set_submitted_by("token of Ada");
  job.set_request_hash("1234");
  job.set_task_logs("/var/log/tasks");
  const v1::Job shown = PageOf(job, {}).job();
  EXPECT_THAT(shown.DebugString(), Not(HasSubstr("Ada")));
  EXPECT_THAT(shown.DebugString(), Not(HasSubstr("1234\"")));
  EXPECT_THAT(shown.DebugString(), Not(HasSubstr("/var/log")));
  EXPECT_EQ(shown.spec().dump(), "/takes/jersey_03");
}

TEST(JobPage, TakesSayWhatTheyAreCalled) {
  const TempFolder folder;
  WriteBytes(folder / "take.json", R"({"slate": "12A"})");
  v1::Job job;
  job.mutable_spec()->set_dump(folder.path());
  const v1::JobPage page = PageOf(job, {});
  ASSERT_EQ(page.take_size(), 1);
  EXPECT_EQ(page.take(0).name() + " " + page.take(0).value(), "Slate 12A");
}

TEST(JobPage, DrivenMeshesHaveAKeyOfTheirOwn) {
  FramePictures frame{.frame = "1", .why_shown = "first frame", .by_state = {{"Front", "x", 4, 3}}};
  FramePictures driven = frame;
  driven.is_driven = true;
  const v1::JobPage page =
      JobPageOf({.job = {}, .frames = {}, .pictures = {frame, driven}, .notes = {}, .sequence = {}});
  EXPECT_EQ(page.pictures(0).state_key().entries(2).meaning(), "inferred from the cloth around it");
  EXPECT_THAT(page.pictures(1).state_key().entries(2).meaning(), HasSubstr("driven: "));
}

}  // namespace
}  // namespace weft
