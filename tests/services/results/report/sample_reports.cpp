// Reports of made-up jobs, for tests that look at pages in a browser.
//
// Usage: sample_reports FOLDER
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include "services/formats/files/json_file.h"
#include "services/results/report/job_report.h"
#include "services/results/report/job_report_parts.h"
#include "tests/services/results/report/sample_job.h"
#include "tests/services/results/report/sample_mesh.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using Frames = std::vector<v1::FrameReport>;

JobReportParts PartsOf(const Frames& frames) {
  return {.job = SampleJob(frames), .frames = frames, .pictures = {}, .notes = {}, .sequence = {}};
}

JobReportParts WithoutFrames() {
  JobReportParts parts;
  parts.job.set_state(v1::JOB_STATE_FAILED);
  parts.job.set_message("rig.json: camera 7 is named twice");
  parts.job.mutable_frames()->set_total(8);
  parts.job.mutable_frames()->set_waiting(8);
  return parts;
}

JobReportParts Troubled() {
  Frames frames = SampleFrames(7);
  for (size_t f = 0; f < frames.size(); ++f)
    f == 1 ? LoseCameras(2, "image has 100 x 100 pixels, the rig says 1280 x 960", frames[f])
           : LoseCameras(1, "no image in the dump", frames[f]);
  FailFrame("no cell of the board was decoded in any view", frames[4]);
  FailFrame("worker ended by signal 9", frames[5]);
  frames[4].mutable_temporal()->set_bridged(true);
  frames[5].set_set_aside(true);
  for (v1::FrameReport& frame : frames)
    for (v1::ViewReport& view : *frame.mutable_views())
      if (view.camera() == "400021") view.set_moved_ms(-3.25);
  frames[6].mutable_mesh()->mutable_scan()->set_points(5000);
  frames[6].mutable_mesh()->mutable_scan()->set_found(4321);
  frames[6].mutable_mesh()->mutable_scan()->set_median_distance_mm(0.25);
  const double none = std::numeric_limits<double>::quiet_NaN();
  frames[3].mutable_mesh()->set_coverage(none);
  frames[3].mutable_mesh()->set_median_observed_sigma_mm(std::numeric_limits<double>::infinity());
  frames[3].mutable_stages(0)->set_time_ms(none);
  frames[3].mutable_mesh()->mutable_stages(0)->set_energy_before(none);
  return PartsOf(frames);
}

JobReportParts Driven() {
  Frames frames = SampleFrames(3);
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
  JobReportParts parts = PartsOf(frames);
  parts.job.mutable_driven()->set_avatar("/avatars/shirt");
  return parts;
}

JobReportParts Outfit() {
  Frames frames = SampleFrames(2);
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
  return PartsOf(frames);
}

JobReportParts EveryState() {
  Frames frames;
  for (int state = v1::FrameState_MIN; state <= v1::FrameState_MAX; ++state) {
    frames.emplace_back().set_frame(absl::StrCat("f", state));
    frames.back().set_state(static_cast<v1::FrameState>(state));
  }
  return {.job = {}, .frames = frames, .pictures = {}, .notes = {}, .sequence = {}};
}

JobReportParts OfWork() {
  JobReportParts parts = PartsOf(SampleFrames(2));
  parts.job.mutable_spec()->mutable_work()->set_kind("copy");
  v1::NamedValue& input = *parts.job.mutable_spec()->mutable_work()->add_inputs();
  input.set_name("meshes"), input.set_value("/results/shirt");
  v1::NamedValue& hash = *parts.job.mutable_inputs()->add_work();
  hash.set_name("meshes"), hash.set_value("1234567890abcdef");
  parts.job.mutable_spec()->mutable_work()->add_options()->set_name("twice");
  return parts;
}

// Every text that comes from outside.
JobReportParts Hostile() {
  const std::string evil =
      "</script><script>window.evil=1</script><img src=x "
      "onerror=window.evil=1>\"'&\x01\xe2\x80\xa8\xe2\x80\xae";
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
  JobReportParts parts = PartsOf({frame, failed});
  v1::Job& job = parts.job;
  for (std::string* field :
       {job.mutable_id(), job.mutable_message(), job.mutable_weft_version(), job.add_warnings(),
        job.mutable_spec()->mutable_dump(), job.mutable_spec()->mutable_rig(),
        job.mutable_spec()->mutable_board(), job.mutable_spec()->mutable_garment(),
        job.mutable_spec()->mutable_out(), job.mutable_spec()->mutable_options()->mutable_preset(),
        job.mutable_inputs()->mutable_rig(), job.mutable_inputs()->mutable_board(),
        job.mutable_inputs()->mutable_garment()})
    *field = evil;
  parts.pictures = {{evil, evil, {{evil, "png", 1, 1}}, {}, {}, {}, false}};
  parts.notes = {evil};
  return parts;
}

JobReportParts Thousands() {
  Frames frames = SampleFrames(3000, 60);
  FailFrame("only 2 of 60 cameras have an image, triangulation needs 3", frames[500]);
  return PartsOf(frames);
}

// A folder of results with meshes, one frame failed, one bridged.
bool WriteWithMeshes(const fs::path& out) {
  Frames frames = SampleFrames(4, 2);
  FailFrame("no cell could be triangulated", frames[1]);
  FailFrame("no cell could be triangulated", frames[2]);
  frames[2].mutable_temporal()->set_bridged(true);
  for (const v1::FrameReport& frame : frames) {
    const fs::path folder = out / frame.frame();
    fs::create_directories(folder);
    if (!WriteJsonFile((folder / "report.json").string(), frame).ok()) return false;
    if ((frame.has_mesh() || frame.temporal().bridged()) &&
        !WriteSampleMesh((folder / "mesh.ply").string()).ok())
      return false;
  }
  return WriteJobReport(out.string(), SampleJob(frames)).ok();
}

int Run(const fs::path& folder) {
  for (const auto& [name, parts] : {std::pair{"plain", PartsOf(SampleFrames(12))},
                                    {"one", PartsOf(SampleFrames(1))},
                                    {"none", WithoutFrames()},
                                    {"troubled", Troubled()},
                                    {"driven", Driven()},
                                    {"outfit", Outfit()},
                                    {"states", EveryState()},
                                    {"work", OfWork()},
                                    {"hostile", Hostile()},
                                    {"thousands", Thousands()}})
    std::ofstream(folder / (std::string(name) + ".html")) << MakeJobReport(parts);
  return WriteWithMeshes(folder / "meshes") ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  if (argc == 2) return weft::Run(argv[1]);
  std::fprintf(stderr, "usage: sample_reports FOLDER\n");
  return EXIT_FAILURE;
}
