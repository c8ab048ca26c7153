// Made-up jobs for the tests of their reports.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

constexpr int kSampleVertices = 13'000;
constexpr int kSampleVerticesWithCell = 12'000;

inline std::string SampleFrameName(int i) { return absl::StrFormat("%06d", i); }

inline void AddReason(const std::string& reason, int count,
                      google::protobuf::RepeatedPtrField<v1::ReasonCount>* reasons) {
  v1::ReasonCount& entry = *reasons->Add();
  entry.set_reason(reason);
  entry.set_count(count);
}

inline void AddSampleViews(int cameras, int i, v1::FrameReport& frame) {
  for (int c = 0; c < cameras; ++c) {
    v1::ViewReport& view = *frame.add_views();
    view.set_camera(absl::StrCat(400'000 + 7 * c));
    view.set_centers(900 + (37 * c) % 1300 + (11 * i) % 60);
    view.set_corners(view.centers() + 80);
    view.set_patches_accepted(3 + c % 4);
    AddReason("too small", 12 + (c + i) % 9, view.mutable_patches_rejected());
    if (c % 3 == 0) AddReason("no margin over the runner-up", 1 + c % 2, view.mutable_patches_rejected());
  }
  frame.set_views_used(cameras);
}

inline void AddSampleMesh(int i, v1::FrameReport& frame) {
  v1::CloudReport& cloud = *frame.mutable_cloud();
  cloud.set_centers(11'600 + static_cast<int>(150 * std::sin(0.7 * i)));
  cloud.set_corners(11'200);
  cloud.set_median_views(7);
  cloud.set_median_sigma_mm(0.09);
  AddReason("too_few_views", 640 + i % 30, cloud.mutable_rejected());
  AddReason("no_consensus", 41, cloud.mutable_rejected());
  AddReason("stretched_edges", 5, cloud.mutable_rejected());
  v1::MeshReport& mesh = *frame.mutable_mesh();
  mesh.set_vertices(kSampleVertices);
  mesh.set_vertices_with_cell(kSampleVerticesWithCell);
  mesh.set_observed(cloud.centers() - 176);
  mesh.set_unclaimed_points(176);
  mesh.set_coverage(static_cast<double>(mesh.observed()) / mesh.vertices_with_cell());
  mesh.set_median_observed_sigma_mm(0.083 + 0.004 * std::cos(0.5 * i));
  const std::vector<std::string> names = {"place", "fill", "rigid_fit", "detection_and_distortion"};
  for (size_t s = 0; s < names.size(); ++s) {
    v1::AlignmentStage& stage = *mesh.add_stages();
    stage.set_name(names[s]);
    stage.set_iterations(static_cast<int>(4 * s * s) + i % 3);
    stage.set_energy_before(52'000.0 / static_cast<double>(1 + s));
    stage.set_energy_after(18'300.0 / static_cast<double>(1 + s));
    stage.set_time_ms(40.0 * static_cast<double>(s) + 5);
  }
}

inline v1::FrameReport SampleFrame(int i, int cameras = 24) {
  v1::FrameReport frame;
  frame.set_frame(SampleFrameName(i));
  frame.set_state(v1::FRAME_STATE_DONE);
  frame.mutable_inputs()->set_rig("00112233445566aa");
  AddSampleViews(cameras, i, frame);
  AddSampleMesh(i, frame);
  const std::vector<std::pair<std::string, double>> times = {
      {"decode", 2900}, {"triangulate", 420}, {"align", 610}, {"write", 90}};
  double total_ms = 0;
  for (const auto& [name, ms] : times) {
    v1::StageTime& stage = *frame.add_stages();
    stage.set_stage(name);
    stage.set_time_ms(ms * (1 + 0.1 * std::sin(1.3 * i)));
    total_ms += stage.time_ms();
  }
  frame.set_total_ms(total_ms);
  frame.set_peak_memory_mib(412);
  frame.set_threads(2);
  return frame;
}

inline void LoseCameras(int count, const std::string& reason, v1::FrameReport& frame) {
  for (int c = 0; c < count; ++c) {
    v1::ViewReport& view = *frame.mutable_views(c);
    const std::string camera = view.camera();
    view.Clear();
    view.set_camera(camera);
    view.set_missing_reason(reason);
  }
  frame.set_views_used(frame.views_used() - count);
  frame.set_views_missing(frame.views_missing() + count);
  frame.set_state(v1::FRAME_STATE_DEGRADED);
  frame.set_reason(absl::StrCat(count, " of ", frame.views_size(), " cameras have no usable image"));
}

inline void FailFrame(const std::string& reason, v1::FrameReport& frame) {
  frame.set_state(v1::FRAME_STATE_FAILED);
  frame.set_reason(reason);
  frame.clear_mesh();
}

inline std::vector<v1::FrameReport> SampleFrames(int count, int cameras = 24) {
  std::vector<v1::FrameReport> frames;
  for (int i = 0; i < count; ++i) frames.push_back(SampleFrame(i, cameras));
  return frames;
}

// With the counts of `frames`.
inline v1::Job SampleJob(const std::vector<v1::FrameReport>& frames) {
  v1::Job job;
  job.set_id("job-7");
  job.set_state(v1::JOB_STATE_DONE);
  job.mutable_spec()->set_dump("/takes/jersey_03");
  job.mutable_spec()->set_rig("/rigs/dome/rig.json");
  job.mutable_spec()->set_board("/boards/shirt/board.json");
  job.mutable_spec()->set_garment("/templates/shirt");
  job.mutable_spec()->set_out("/results/jersey_03");
  job.mutable_inputs()->set_rig("00112233445566aa");
  job.mutable_inputs()->set_board("0f1e2d3c4b5a6978");
  job.mutable_inputs()->set_garment("8796a5b4c3d2e1f0");
  v1::FrameCounts& counts = *job.mutable_frames();
  for (const v1::FrameReport& frame : frames) {
    counts.set_total(counts.total() + 1);
    if (frame.state() == v1::FRAME_STATE_DONE) counts.set_done(counts.done() + 1);
    if (frame.state() == v1::FRAME_STATE_DEGRADED) counts.set_degraded(counts.degraded() + 1);
    if (frame.state() == v1::FRAME_STATE_FAILED) counts.set_failed(counts.failed() + 1);
    counts.set_bridged(counts.bridged() + frame.temporal().bridged());
  }
  job.set_created_unix_ns(1'790'000'000'000'000'000);
  job.set_started_unix_ns(1'790'000'002'000'000'000);
  job.set_finished_unix_ns(1'790'000'052'000'000'000);
  job.set_weft_version("0.1.0");
  return job;
}

}  // namespace weft
