// Each check of a registration has a case in which it alone fails, and the verdict is not good.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "services/formats/verdict/limits.h"
#include "services/results/report/job_verdict.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A job of two frames of five cameras that has all checks, and all of them good.
struct FilmedJob {
  v1::Job job;
  std::vector<v1::FrameReport> frames;

  FilmedJob() : frames(2) {
    job.set_state(v1::JOB_STATE_DONE);
    job.mutable_frames()->set_total(2);
    job.mutable_frames()->set_done(2);
    for (v1::FrameReport& frame : frames) {
      frame.set_frame(&frame == &frames[0] ? "0" : "1");
      frame.set_state(v1::FRAME_STATE_DONE);
      for (const char* camera : {"a", "b", "c", "d", "e"}) AddView(frame, camera);
      frame.mutable_cloud()->set_centers(190);
      frame.mutable_cloud()->set_corners(180);
      frame.mutable_cloud()->set_print_scale(1.01);
      frame.mutable_mesh()->set_vertices_with_cell(200);
      frame.mutable_mesh()->set_observed(180);
      frame.mutable_mesh()->set_coverage(0.9);
      v1::ScanReport& scan = *frame.mutable_mesh()->mutable_scan();
      scan.set_points(1000);
      scan.set_found(800);
      scan.set_median_distance_mm(0.5);
    }
  }

  static void AddView(v1::FrameReport& frame, const std::string& camera) {
    v1::ViewReport& view = *frame.add_views();
    view.set_camera(camera);
    view.set_centers(100);
    view.set_grey_levels(140);
    view.set_image_hash(camera + frame.frame());
    view.set_vertices_in_view(300);
    view.set_vertices_seen(270);
    v1::CameraAgreement& agreement = *view.mutable_agreement();
    agreement.set_compared(300);
    agreement.set_agreeing(299);
    agreement.set_median_px(0.1);
    agreement.set_scale(1);
    agreement.set_scale_sigma(1e-4);
    agreement.set_perspective_sigma(0.004);
  }

  std::vector<std::string> Failing() const {
    std::vector<std::string> ids;
    const v1::Verdict verdict = AssessJob(job, frames);
    for (const v1::VerdictCheck& check : verdict.checks())
      if (check.grade() != v1::GRADE_GOOD) ids.push_back(check.id());
    EXPECT_EQ(ids.empty(), verdict.grade() == v1::GRADE_GOOD) << verdict.reason();
    return ids;
  }
};

using Change = std::function<void(v1::FrameReport&)>;

Change OfView(int place, const std::function<void(v1::ViewReport&)>& change) {
  return [=](v1::FrameReport& frame) { change(*frame.mutable_views(place)); };
}

Change OfViews(const std::function<void(v1::ViewReport&)>& change) {
  return [=](v1::FrameReport& frame) {
    for (v1::ViewReport& view : *frame.mutable_views()) change(view);
  };
}

const std::map<std::string, Change>& Cases() {
  static const std::map<std::string, Change> cases = {
      {"decode.cells", OfViews([](auto& view) { view.set_centers(10); })},
      {"decode.grey_levels", OfView(1, [](auto& view) { view.set_grey_levels(20); })},
      {"register.rays_meet",
       [](auto& frame) {
         v1::ReasonCount& rejected = *frame.mutable_cloud()->add_rejected();
         rejected.set_reason("no_consensus");
         rejected.set_count(100);
       }},
      {"register.cameras_known", [](auto& frame) { frame.add_unknown_cameras("f"); }},
      {"register.cameras_agree", OfView(2, [](auto& view) { view.mutable_agreement()->set_agreeing(10); })},
      {"register.offset", OfViews([](auto& view) { view.mutable_agreement()->set_common_px(0.6); })},
      {"register.cameras_see", OfView(2, [](auto& view) { view.set_vertices_seen(3); })},
      {"register.images_new", OfView(3, [](auto& view) { view.set_image_hash("same"); })},
      {"register.lens", OfViews([](auto& view) { view.mutable_agreement()->set_perspective(-0.05); })},
      {"register.scale", [](auto& frame) { frame.mutable_cloud()->set_print_scale(1.06); }},
      {"register.on_template", [](auto& frame) { frame.mutable_mesh()->set_unclaimed_points(150); }},
      {"register.scan_points", [](auto& frame) { frame.mutable_mesh()->mutable_scan()->set_found(3); }},
      {"register.scan_distance",
       [](auto& frame) { frame.mutable_mesh()->mutable_scan()->set_median_distance_mm(3); }},
      {"register.coverage",
       [](auto& frame) {
         frame.mutable_mesh()->set_observed(80);
         frame.mutable_mesh()->set_coverage(0.4);
       }},
  };
  return cases;
}

TEST(ChecksAlone, AllAreGoodOfAGoodJob) { EXPECT_THAT(FilmedJob().Failing(), IsEmpty()); }

TEST(ChecksAlone, EachFailsAlone) {
  for (const auto& [id, change] : Cases()) {
    FilmedJob film;
    for (v1::FrameReport& frame : film.frames) change(frame);
    EXPECT_THAT(film.Failing(), ElementsAre(id));
  }
}

TEST(ChecksAlone, OneBlankImageFailsAlone) {
  FilmedJob film;
  film.frames[1].mutable_views(2)->set_vertices_seen(0);
  EXPECT_THAT(film.Failing(), ElementsAre("register.images_see"));
  EXPECT_THAT(
      AssessJob(film.job, film.frames).reason(),
      testing::HasSubstr("1 of 10 images shows nothing of the cloth that faces its camera: camera c in "
                         "frame 1"));
}

TEST(ChecksAlone, FramesAndImagesFailAlone) {
  FilmedJob film;
  film.frames[1].set_state(v1::FRAME_STATE_FAILED);
  film.frames[1].clear_mesh();
  film.job.mutable_frames()->set_done(1);
  film.job.mutable_frames()->set_failed(1);
  EXPECT_THAT(film.Failing(), ElementsAre("register.frames"));

  FilmedJob without;
  without.frames[0].mutable_views(1)->set_missing_reason("b.png: no such file");
  EXPECT_THAT(without.Failing(), ElementsAre("register.images"));
}

TEST(ChecksAlone, NoneIsForgotten) {
  for (const Limit* limit : kLimits) {
    const std::string id(limit->id);
    if (!absl::StartsWith(id, "register.") && !absl::StartsWith(id, "decode.")) continue;
    const bool has_own_test =
        id == "register.frames" || id == "register.images" || id == "register.images_see";
    EXPECT_TRUE(Cases().contains(id) || has_own_test) << id;
  }
}

}  // namespace
}  // namespace weft
