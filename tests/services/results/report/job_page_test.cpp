#include "services/results/report/job_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/results/report/driven_sigma.h"
#include "services/results/report/job_summary.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/report/proto_text.h"
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

// Everything of the page but the options, which are listed in the pipeline's order.
TEST(JobPage, EveryPartIsThatOfTheJob) {
  std::vector<v1::FrameReport> frames = {SampleFrame(0, 1), SampleFrame(1, 1)};
  frames[1].set_state(v1::FRAME_STATE_FAILED), frames[1].set_reason("too dark"),
      frames[1].set_set_aside(true);
  frames[1].set_views_missing(2);
  for (v1::FrameReport& frame : frames) {
    frame.mutable_mesh()->clear_stages();
    frame.mutable_cloud()->clear_rejected();
    frame.clear_stages();
    frame.set_total_ms(4000);
  }
  frames[0].mutable_mesh()->set_observed(9000), frames[0].mutable_mesh()->set_coverage(0.75);
  frames[0].add_unknown_cameras("x");
  v1::StageTime& stage = *frames[0].add_stages();
  stage.set_stage("decode"), stage.set_time_ms(2900);
  v1::Job job = SampleJob(frames);
  job.mutable_spec()->mutable_options()->set_preset("paper");
  job.mutable_spec()
      ->mutable_options()
      ->mutable_pipeline()
      ->mutable_triangulation()
      ->mutable_consensus()
      ->set_min_views(4);
  v1::JobPage page =
      JobPageOf({.job = job, .frames = frames, .pictures = {}, .notes = {"a note"}, .sequence = {}});
  page.clear_paper();
  ASSERT_EQ(page.options_size(), 1);
  EXPECT_EQ(page.options(0).path(), "triangulation.consensus.min_views");
  EXPECT_EQ(page.options(0).value(), "4");
  EXPECT_NE(page.options(0).preset(), "");
  EXPECT_NE(page.options(0).meaning(), "");
  page.clear_options();
  EXPECT_EQ(page.DebugString(),
            TextOf<v1::JobPage>(
                R"(job { id: "job-7" spec { dump: "/takes/jersey_03" rig: "/rigs/dome/rig.json" board:
"/boards/shirt/board.json" garment: "/templates/shirt" out: "/results/jersey_03" options { preset:
"paper" } } state: JOB_STATE_DONE frames { total: 2 done: 1 failed: 1 } inputs { rig: "00112233445566aa"
board: "0f1e2d3c4b5a6978" garment: "8796a5b4c3d2e1f0" } created_unix_ns: 1790000000000000000
started_unix_ns: 1790000002000000000 finished_unix_ns: 1790000052000000000 weft_version: "0.1.0" verdict
{ grade: GRADE_BAD reason: "1 of 2 frames could not be registered: too dark" remedy:
"See the reasons in the table of frames of report.html, fix them, and run the same command again." checks
{ id: "decode.cells" name: "cells decoded in an image, mean" grade: GRADE_GOOD value: "905.5" limits:
"good from 20, usable from 2" } checks { id: "register.rays_meet" name:
"cells and corners at which the cameras\' rays meet" grade: GRADE_GOOD value: "100.0 %" limits:
"good from 90 %, usable from 70 %" } checks { id: "register.cameras_known" name:
"cameras of the recording that the rig has" grade: GRADE_USABLE value: "50.0 %" limits:
"good from 100 %, usable from 50 %" } checks { id: "register.on_template" name:
"triangulated cells that the template has" grade: GRADE_GOOD value: "98.5 %" limits:
"good from 50 %, usable from 0 %" } checks { id: "register.frames" name: "frames registered" grade:
GRADE_BAD value: "50.0 %" limits: "good from 100 %, usable from 90 %" } checks { id: "register.images"
name: "images that could be used" grade: GRADE_GOOD value: "100.0 %" limits:
"good from 99 %, usable from 50 %" } checks { id: "register.coverage" name:
"cells of the garment that were observed" grade: GRADE_GOOD value: "75.0 %" limits:
"good from 60 %, usable from 20 %" } others { grade: GRADE_USABLE reason:
"1 of 2 cameras of the recording is not in the rig, their images were not used: x" remedy:
"Register with the rig of this take; calibrate one of all of its cameras." } } } headline:
"1 of 2 frames registered, 75.0\302\240% of the cells observed." remarks: "1 frame failed: too dark"
notes: "a note" figures { registered: 1 coverage: 0.75 lowest_coverage: 0.75 lowest_coverage_frame:
"000000" highest_coverage: 0.75 median_cells: 11600 median_rays: nan median_residual_px: nan
median_sigma_mm: 0.087000000000000008 median_frame_ms: 4000 peak_memory_mib: 412 wall_ms: 50000
unknown_cameras: 1 } frames { frame: "000000" state: FRAME_STATE_DONE views_used: 1 cloud { centers:
11600 corners: 11200 median_views: 7 median_sigma_mm: 0.09 } mesh { vertices: 13000 vertices_with_cell:
12000 observed: 9000 unclaimed_points: 176 coverage: 0.75 median_observed_sigma_mm: 0.087000000000000008
} stages { stage: "decode" time_ms: 2900 } total_ms: 4000 threads: 2 } frames { frame: "000001" state:
FRAME_STATE_FAILED reason: "too dark" set_aside: true views_used: 1 views_missing: 2 cloud { centers:
11696 corners: 11200 median_views: 7 median_sigma_mm: 0.09 } mesh { vertices: 13000 vertices_with_cell:
12000 observed: 11520 unclaimed_points: 176 coverage: 0.96 median_observed_sigma_mm: 0.0865103302475615 }
total_ms: 4000 threads: 2 } cameras { camera: "400000" frames_seen: 2 centers: 1811 corners: 1971
patches_accepted: 6 patches_rejected { reason: "too small" count: 25 } patches_rejected { reason:
"no margin over the runner-up" count: 2 } residual_px: nan median_grey_levels: nan } preset: "paper")"));
}

TEST(JobPage, FramesOfATakeAreNamedOnTheSet) {
  const TempFolder folder;
  WriteBytes(folder / "take.json",
             R"({"slate": "12A", "name": "3", "notes": "windy", "timecode": "01:02:03:04"})");
  v1::Job job;
  job.mutable_spec()->set_dump(folder.path());
  std::string facts;
  const v1::JobPage page = PageOf(job, {});
  for (const v1::NamedValue& fact : page.take()) facts += fact.name() + " " + fact.value() + ", ";
  EXPECT_EQ(facts, "Slate 12A, Take 3, Notes windy, Timecode 01:02:03:04, ");
  job.mutable_spec()->mutable_work();
  EXPECT_THAT(PageOf(job, {}).take(), IsEmpty()) << "operations have no take";
}

TEST(JobPage, PicturesHaveTheirKeysAndTheStillIsTheFirst) {
  FramePictures none{.frame = "0", .why_shown = "failed"};
  FramePictures frame{.frame = "1", .why_shown = "first frame", .by_state = {{"Front", "x", 4, 3}}};
  frame.by_sigma = {{"Front", "y", 5, 6}}, frame.sigma_range_mm = {0, 0.5};
  frame.in_images = {{"Camera a", "z", 7, 8, "image/jpeg"}};
  v1::PageSequence sequence;
  sequence.add_frames()->set_name("1");
  const v1::JobPage page =
      JobPageOf({.job = {}, .frames = {}, .pictures = {none, frame}, .notes = {}, .sequence = sequence});
  ASSERT_EQ(page.pictures_size(), 2);
  v1::PageFramePictures shown = page.pictures(1);
  EXPECT_EQ(shown.state_key().entries_size(), 3);
  shown.clear_state_key();
  shown.mutable_sigma_key()->mutable_scale()->clear_colors();
  EXPECT_EQ(
      shown.DebugString(),
      TextOf<v1::PageFramePictures>(
          R"(frame: "1" why_shown: "first frame" by_state { title: "Front" bytes: "x" type: "image/png" width_px: 4
height_px: 3 } by_sigma { title: "Front" bytes: "y" type: "image/png" width_px: 5 height_px: 6 }
sigma_key { scale { high: 0.5 label: "sigma" unit: "mm" } } in_images { title: "Camera a" bytes: "z"
type: "image/jpeg" width_px: 7 height_px: 8 })"));
  EXPECT_EQ(page.sequence().still().title(), "Frame 1, colours: state");
  EXPECT_EQ(page.sequence().still().bytes(), "x");
}

TEST(JobPage, AVerdictThatTheJobHasIsKept) {
  v1::Job job = SampleJob({});
  job.mutable_verdict()->set_grade(v1::GRADE_USABLE);
  job.mutable_verdict()->set_reason("as it was");
  EXPECT_EQ(PageOf(job, {}).job().verdict().reason(), "as it was");
  EXPECT_EQ(PageOf(job, {}).preset(), "best");
  job.mutable_spec()->mutable_options()->set_preset("no such");
  EXPECT_EQ(PageOf(job, {}).preset(), "no such");
  EXPECT_THAT(PageOf(job, {}).options(), IsEmpty());
}

}  // namespace
}  // namespace weft
