#include "services/results/report/html_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/results/report/driven_sigma.h"
#include "services/results/report/html_text.h"
#include "services/results/report/job_summary.h"
#include "tests/services/results/report/sample_job.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

size_t CountOf(const std::string& text, const std::string& what) {
  size_t count = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

// Every tag that is opened is closed in order; attribute values hold no angle brackets (all are escaped).
void ExpectBalancedTags(const std::string& html) {
  std::vector<std::string> open;
  for (size_t at = html.find('<', html.find("</style>")); at != std::string::npos;
       at = html.find('<', at + 1)) {
    const size_t end = html.find('>', at);
    ASSERT_NE(end, std::string::npos);
    const std::string tag = html.substr(at + 1, end - at - 1);
    const std::string name = tag.substr(tag[0] == '/', tag.find_first_of(" /", 1) - (tag[0] == '/'));
    if (tag.back() == '/' || name == "br" || name == "img" || name == "style" || name == "head") continue;
    if (tag[0] != '/') {
      open.push_back(name);
    } else if (name == "html" && open.empty()) {
      return;  // opened before the style sheet
    } else {
      ASSERT_FALSE(open.empty()) << "closes " << name;
      ASSERT_EQ(open.back(), name);
      open.pop_back();
    }
  }
}

std::string Report(const std::vector<v1::FrameReport>& frames) {
  return MakeJobReport(SampleJob(frames), frames, {});
}

TEST(JobReport, GarmentsOfAJointTemplateAreToldApart) {
  std::vector<v1::FrameReport> frames = SampleFrames(2);
  EXPECT_THAT(Report(frames), Not(HasSubstr("id=\"garments\"")));
  for (v1::FrameReport& frame : frames) {
    for (const auto& [id, observed] : {std::pair("skirt", 50), std::pair("<shirt>", 90)}) {
      v1::GarmentReport& garment = *frame.mutable_mesh()->add_garments();
      garment.set_id(id);
      garment.set_vertices(1200);
      garment.set_vertices_with_cell(100);
      garment.set_observed(observed);
      garment.set_coverage(observed / 100.0);
    }
    frame.mutable_mesh()->add_overlaps()->set_inner("skirt");
    frame.mutable_mesh()->mutable_overlaps(0)->set_outer("<shirt>");
  }
  frames[1].mutable_mesh()->mutable_garments(0)->set_coverage(0.3);
  const std::string html = Report(frames);
  ExpectBalancedTags(html);
  EXPECT_THAT(html, HasSubstr("&lt;shirt&gt; lies over skirt in 2 frames."));
  EXPECT_THAT(
      html,
      HasSubstr("Of the garments&#39; cells were observed: skirt 50.0\u00a0%, &lt;shirt&gt; 90.0\u00a0%."));
  EXPECT_THAT(html, HasSubstr("<td>skirt</td><td>1,200</td><td>50.0\u00a0%</td><td>30.0\u00a0%</td>"));
}

TEST(JobReport, ACameraThatMovedIsAnAlarm) {
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
  const std::string html = Report(frames);
  EXPECT_THAT(html, HasSubstr("Camera " + frames[0].views(1).camera() +
                              " moved, or its calibration is off: it sees the cloth 2.33 px (right 2.30, "
                              "down -0.40; 45 sigmas)"));
  // Camera 2 is pulled along.
  EXPECT_EQ(CountOf(html, "moved, or its calibration is off"), 1u);
  EXPECT_THAT(html, HasSubstr("usable</span>"));
}

// An avatar drives with cameras too few to observe cells: such jobs have no coverage, and figures of their
// own.
TEST(JobReport, DrivenJobsHaveTheirOwnFigures) {
  std::vector<v1::FrameReport> frames = SampleFrames(3);
  for (v1::FrameReport& frame : frames) {
    frame.clear_cloud();
    frame.mutable_mesh()->set_observed(0);
    frame.mutable_mesh()->set_coverage(0);
    frame.mutable_mesh()->set_median_observed_sigma_mm(0);
    v1::DrivenReport& driven = *frame.mutable_driven();
    driven.set_rays(4321);
    driven.set_rejected_rays(21);
    driven.set_residual_px(0.37);
    driven.set_median_sigma_mm(2.25);
  }
  frames[0].mutable_driven()->set_started_anew(true);
  v1::Job job = SampleJob(frames);
  job.mutable_driven()->set_avatar("/avatars/shirt");
  const JobSummary summary = Summarize(job, frames);
  EXPECT_FALSE(std::isfinite(summary.coverage));
  EXPECT_EQ(summary.median_sigma_mm, 2.25);
  EXPECT_EQ(Headline(job, summary), "3 of 3 frames driven.");
  for (const char* camera : {"front", "back"}) job.mutable_driven()->add_cameras(camera);
  EXPECT_EQ(DrivenSigmaNote(job), "");
  job.mutable_driven()->add_cameras("left");
  EXPECT_THAT(DrivenSigmaNote(job), HasSubstr("too small before 3 cameras"));
  EXPECT_THAT(Remarks(job, summary), ::testing::Contains(DrivenSigmaNote(job)));
  const std::string html = MakeJobReport(job, frames, {}, {});
  for (const char* text : {"0.000", "of the cells observed", "Observed cells", "Triangulated"})
    EXPECT_EQ(html.find(text), std::string::npos) << text;
  for (const char* text :
       {"4,300", "0.37", "2.25", "sigma of all vertices", "found without the frame before"})
    EXPECT_NE(html.find(text), std::string::npos) << text;
}

TEST(JobReport, SaysInWordsWhatCameOut) {
  const std::vector<v1::FrameReport> frames = SampleFrames(12);
  const std::string html = Report(frames);
  int observed = 0;
  for (const v1::FrameReport& frame : frames) observed += frame.mesh().observed();
  const std::string share = absl::StrFormat("%.1f", 100.0 * observed / (12 * kSampleVerticesWithCell));
  EXPECT_THAT(html, HasSubstr("good</span> 12 of 12 frames registered, " + share +
                              "\xC2\xA0% of the cells observed.</h1>"));
  EXPECT_THAT(html, HasSubstr("50.0\xC2\xA0s in all"));
  EXPECT_THAT(html, HasSubstr("<code>0f1e2d3c4b5a6978</code>"));
  EXPECT_THAT(html, HasSubstr("/takes/jersey_03"));
  EXPECT_THAT(html, HasSubstr("detection and distortion"));
  EXPECT_THAT(html, HasSubstr("seen by fewer cameras than triangulation needs"));
  EXPECT_THAT(html, HasSubstr("Every camera gave a usable image"));
  EXPECT_EQ(CountOf(html, "<svg"), 4u);
  ExpectBalancedTags(html);
}

TEST(JobReport, LoadsNothingAndRunsNothing) {
  const std::string html = Report(SampleFrames(3));
  for (const char* what :
       {"<script", "<link", "http:", "https:", "@import", "url(", "javascript:", " onload"}) {
    EXPECT_THAT(html, Not(HasSubstr(what)));
  }
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
}

TEST(JobReport, EscapesEveryStringOfTheMessages) {
  const std::string evil = "<script>alert('x')</script>\"&\x01\xff";
  v1::FrameReport frame = SampleFrame(0);
  LoseCameras(2, evil, frame);
  frame.set_frame(evil);
  frame.set_reason(evil);
  for (v1::ViewReport& view : *frame.mutable_views()) {
    view.set_camera(evil + view.camera());
    for (v1::ReasonCount& rejected : *view.mutable_patches_rejected()) rejected.set_reason(evil);
  }
  for (v1::ReasonCount& rejected : *frame.mutable_cloud()->mutable_rejected()) rejected.set_reason(evil);
  for (v1::AlignmentStage& stage : *frame.mutable_mesh()->mutable_stages()) stage.set_name(evil);
  for (v1::StageTime& stage : *frame.mutable_stages()) stage.set_stage(evil);
  v1::FrameReport failed = frame;
  FailFrame(evil, failed);
  v1::Job job = SampleJob({frame, failed});
  for (std::string* field :
       {job.mutable_id(), job.mutable_message(), job.mutable_weft_version(), job.add_warnings(),
        job.mutable_spec()->mutable_dump(), job.mutable_spec()->mutable_rig(),
        job.mutable_spec()->mutable_board(), job.mutable_spec()->mutable_garment(),
        job.mutable_spec()->mutable_out(), job.mutable_spec()->mutable_options()->mutable_preset(),
        job.mutable_inputs()->mutable_rig(), job.mutable_inputs()->mutable_board(),
        job.mutable_inputs()->mutable_garment()}) {
    *field = evil;
  }
  const FramePictures pictures{evil, evil, {{evil, "png", 1, 1}}, {}, {}};
  const std::string html = MakeJobReport(job, {frame, failed}, {pictures}, {evil});
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("alert('x')")));
  EXPECT_THAT(html, Not(HasSubstr("\x01")));
  EXPECT_THAT(html, Not(HasSubstr("\xff")));
  EXPECT_GT(CountOf(html, "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&quot;&amp;"), 40u);
  ExpectBalancedTags(html);
}

TEST(JobReport, TellsDegradedAndFailedFramesWithTheirReasons) {
  std::vector<v1::FrameReport> frames = SampleFrames(6);
  LoseCameras(2, "image has 100 x 100 pixels, the rig says 1280 x 960", frames[1]);
  FailFrame("no cell of the board was decoded in any view", frames[4]);
  FailFrame("worker ended by signal 9", frames[5]);
  frames[5].set_set_aside(true);
  const std::string html = Report(frames);
  EXPECT_THAT(html, HasSubstr("bad</span> 4 of 6 frames registered, "));
  EXPECT_THAT(html, HasSubstr("bad</span>"));
  EXPECT_THAT(html, HasSubstr("1 frame failed: no cell of the board was decoded in any view"));
  EXPECT_THAT(html, HasSubstr("1 frame is degraded: it was registered, with cameras missing."));
  EXPECT_THAT(html, HasSubstr("image has 100 x 100 pixels, the rig says 1280 x 960"));
  EXPECT_THAT(html, HasSubstr("a new job retries it"));
  EXPECT_THAT(html, HasSubstr("frame 000004: no mesh"));
  EXPECT_THAT(html, HasSubstr("<td>22 of 24</td>"));
}

TEST(JobReport, NamesCamerasWithoutImagesFirst) {
  std::vector<v1::FrameReport> frames = SampleFrames(5);
  for (v1::FrameReport& frame : frames) LoseCameras(1, "no image in the dump", frame);
  const std::string html = Report(frames);
  EXPECT_THAT(
      html,
      HasSubstr(
          "<tr><td><bdi>400000</bdi></td><td>5 of 5</td><td>no image in the dump (5 frames)</td></tr>"));
  EXPECT_THAT(html, HasSubstr("<b>23 of 24</b>"));
  EXPECT_LT(html.find("Without a usable image"), html.find("Contribution of each camera"));
}

TEST(JobReport, OneFrameIsDrawnAndTold) {
  const std::string html = Report(SampleFrames(1));
  EXPECT_THAT(html, HasSubstr("good</span> 1 of 1 frame registered, "));
  EXPECT_EQ(CountOf(html, "<circle"), 3u);
  EXPECT_THAT(html, HasSubstr("frame 000000: decode "));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
  EXPECT_THAT(html, Not(HasSubstr("inf\"")));
}

TEST(JobReport, ThousandFramesOfADomeStayReadable) {
  std::vector<v1::FrameReport> frames = SampleFrames(1000, 211);
  FailFrame("only 2 of 211 cameras have an image, triangulation needs 3", frames[500]);
  const std::string html = Report(frames);
  EXPECT_THAT(html, HasSubstr("999 of 1,000 frames registered"));
  EXPECT_THAT(html, HasSubstr("<summary>All 1,000 frames</summary>"));
  EXPECT_LE(CountOf(html, "class=\"range\""), 3u * 120);
  EXPECT_EQ(CountOf(html, "<circle"), 0u);
  EXPECT_THAT(html, HasSubstr("frames 000495 to 000503: 1 without mesh"));
  EXPECT_LT(html.size(), 2u << 20);
  ExpectBalancedTags(html);
}

TEST(JobReport, EveryStateOfAJobHasItsHeadline) {
  const std::vector<v1::FrameReport> frames = SampleFrames(2);
  v1::Job job = SampleJob(frames);
  job.mutable_frames()->set_total(5);
  job.mutable_frames()->set_cancelled(3);
  const auto headline = [&](v1::JobState state) {
    job.set_state(state);
    return MakeJobReport(job, frames, {});
  };
  EXPECT_THAT(headline(v1::JOB_STATE_CANCELLED),
              HasSubstr("bad</span> Cancelled: 2 of 5 frames registered, "));
  EXPECT_THAT(headline(v1::JOB_STATE_CANCELLED), HasSubstr("3 frames were not computed."));
  EXPECT_THAT(headline(v1::JOB_STATE_RUNNING), HasSubstr("<h1>Still running: 2 of 5 frames registered, "));
  EXPECT_THAT(headline(v1::JOB_STATE_QUEUED), HasSubstr("<h1>Waiting to start: "));
  EXPECT_THAT(headline(v1::JOB_STATE_FAILED),
              HasSubstr("bad</span> The job failed: 2 of 5 frames registered, "));
  EXPECT_THAT(headline(v1::JOB_STATE_UNSPECIFIED), HasSubstr("</span> 2 of 5 frames registered, "));
}

TEST(JobReport, EveryStateOfAFrameIsNamed) {
  std::vector<v1::FrameReport> frames;
  for (int state = v1::FrameState_MIN; state <= v1::FrameState_MAX; ++state) {
    v1::FrameReport frame;
    frame.set_frame(absl::StrCat("f", state));
    frame.set_state(static_cast<v1::FrameState>(state));
    frames.push_back(frame);
  }
  v1::Job job;
  const std::string html = MakeJobReport(job, frames, {});
  for (const char* text : {"not recorded", "waiting", "running", "done", "degraded", "failed", "cancelled"}) {
    EXPECT_THAT(html, HasSubstr(std::string(text) + "</span>"));
  }
  ExpectBalancedTags(html);
}

TEST(JobReport, BridgedFrameIsNamed) {
  v1::FrameReport bridged = SampleFrame(1);
  FailFrame("no cell of the board was decoded in any view", bridged);
  bridged.mutable_temporal()->set_bridged(true);
  const std::string html = MakeJobReport(SampleJob({SampleFrame(0), bridged}), {SampleFrame(0), bridged}, {});
  EXPECT_THAT(html, HasSubstr("bridged</span>"));
  EXPECT_THAT(html, HasSubstr("1 of them is bridged"));
}

TEST(JobReport, JobWithoutAnyFrameStillHasAReport) {
  v1::Job job;
  job.set_state(v1::JOB_STATE_FAILED);
  job.set_message("rig.json: camera 7 is named twice");
  job.mutable_frames()->set_total(8);
  job.mutable_frames()->set_waiting(8);
  const std::string html = MakeJobReport(job, {}, {});
  EXPECT_THAT(html, HasSubstr("bad</span> The job failed: No frame was registered.</h1>"));
  EXPECT_THAT(html, HasSubstr("rig.json: camera 7 is named twice"));
  EXPECT_THAT(html, HasSubstr("No frame has a report."));
  EXPECT_EQ(CountOf(html, "<svg"), 0u);
  ExpectBalancedTags(html);
}

TEST(JobReport, NumbersThatAreNoneAreDashes) {
  std::vector<v1::FrameReport> frames = SampleFrames(3);
  for (v1::FrameReport& frame : frames) {
    frame.mutable_mesh()->set_coverage(std::numeric_limits<double>::quiet_NaN());
    frame.mutable_mesh()->set_median_observed_sigma_mm(std::numeric_limits<double>::infinity());
    frame.mutable_stages(0)->set_time_ms(std::numeric_limits<double>::quiet_NaN());
    frame.mutable_mesh()->mutable_stages(0)->set_energy_before(std::numeric_limits<double>::quiet_NaN());
  }
  const std::string html = Report(frames);
  EXPECT_THAT(html, Not(HasSubstr("nan")));
  EXPECT_THAT(html, Not(HasSubstr(">inf")));
  ExpectBalancedTags(html);
}

TEST(JobReport, PicturesAreEmbedded) {
  const FramePictures pictures{
      "000000", "first frame", {{"Front", "abc", 480, 560}}, {{"Front", "xyz", 480, 560}}, {0, 0.3}};
  const std::vector<v1::FrameReport> frames = SampleFrames(1);
  const std::string html = MakeJobReport(SampleJob(frames), frames, {pictures});
  EXPECT_THAT(html, HasSubstr("src=\"data:image/png;base64,YWJj\""));
  EXPECT_THAT(html, HasSubstr("alt=\"Front of frame 000000, coloured by state\""));
  EXPECT_THAT(html, HasSubstr("0.3 mm and more"));
}

TEST(JobReport, StandsBesideThePaper) {
  std::vector<v1::FrameReport> frames = SampleFrames(3);
  frames[1].mutable_mesh()->set_coverage(0.625);
  const std::string html = Report(frames);
  EXPECT_THAT(html, HasSubstr("<section id=\"paper\">"));
  EXPECT_THAT(html,
              HasSubstr("<td>1.50</td><td>9.27</td><td>75.0\xC2\xA0% (54.0\xC2\xA0% to 90.0\xC2\xA0%)</td>"));
  EXPECT_THAT(html, HasSubstr("(62.5\xC2\xA0% to "));
  EXPECT_THAT(html, HasSubstr("measures drift and distortion"));
}

TEST(JobReport, TellsResidualsOfCamerasAndVersionsOfAlgorithms) {
  std::vector<v1::FrameReport> frames = SampleFrames(2, 3);
  for (int f = 0; f < 2; ++f) {
    v1::CameraBias& bias = *frames[f].mutable_views(1)->mutable_bias();
    bias.set_observations(f == 0 ? 300 : 100);
    bias.set_rms_px(f == 0 ? 0.1 : 0.3);
    v1::StageKey& key = *frames[f].add_keys();
    key.set_stage("second_pass");
    key.set_version(2);
  }
  const std::string html = Report(frames);
  // sqrt((300 * 0.01 + 100 * 0.09) / 400)
  EXPECT_THAT(html, HasSubstr("camera 400007: 0.173\xC2\xA0px"));
  EXPECT_THAT(html, HasSubstr("<td>0.17</td>"));
  EXPECT_THAT(html, HasSubstr("<td>Algorithms</td><td>second pass 2</td>"));
}

TEST(JobReport, SameBytesForTheSameJob) {
  const std::vector<v1::FrameReport> frames = SampleFrames(20);
  EXPECT_EQ(Report(frames), Report(frames));
}

TEST(HtmlText, NumbersReadWell) {
  EXPECT_EQ(FormatCount(1234567), "1,234,567");
  EXPECT_EQ(FormatCount(999), "999");
  EXPECT_EQ(FormatCount(-1200),
            "\xE2\x88\x92"
            "1,200");
  EXPECT_EQ(FormatNumber(10447.316, 2), "10,447.32");
  EXPECT_EQ(FormatNumber(-0.25, 1),
            "\xE2\x88\x92"
            "0.2");
  EXPECT_EQ(FormatNumber(-0.0004, 3), "0.000");
  EXPECT_EQ(FormatNumber(12, 0), "12");
  EXPECT_EQ(FormatPercent(0.9997), "99.9\xC2\xA0%");
  EXPECT_EQ(FormatPercent(1), "100.0\xC2\xA0%");
  EXPECT_EQ(FormatDuration(0.3), "0.3\xC2\xA0ms");
  EXPECT_EQ(FormatDuration(2310), "2.31\xC2\xA0s");
  EXPECT_EQ(FormatDuration(250'000),
            "4\xC2\xA0min\xC2\xA0"
            "10\xC2\xA0s");
  EXPECT_EQ(FormatDuration(3 * 3'600'000 + 300'000),
            "3\xC2\xA0h\xC2\xA0"
            "5\xC2\xA0min");
  EXPECT_EQ(FormatUnixTime(1'790'000'000'000'000'000), "2026-09-21 14:13:20 UTC");
  EXPECT_EQ(Counted(1, "frame", "frames"), "1 frame");
}

TEST(HtmlText, BrokenCharactersAreReplaced) {
  EXPECT_EQ(EscapeHtml("a\xC3\xA9z"), "a\xC3\xA9z");
  EXPECT_EQ(EscapeHtml("\xC3"), "\xEF\xBF\xBD");
  EXPECT_EQ(EscapeHtml("\xE2\x82"), "\xEF\xBF\xBD\xEF\xBF\xBD");
  EXPECT_EQ(EscapeHtml(std::string("\0", 1)), "\xEF\xBF\xBD");
  EXPECT_EQ(Shortened("h\xC3\xA9llo", 2), "h\xC3\xA9\xE2\x80\xA6");
  EXPECT_EQ(Shortened("hi", 2), "hi");
}

}  // namespace
}  // namespace weft
