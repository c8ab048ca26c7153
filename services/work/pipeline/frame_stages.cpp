#include "services/work/pipeline/frame_stages.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "alignment/cloth_in_view.h"
#include "alignment/map_place.h"
#include "alignment/start_mesh.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "pattern/image/pixel_allocator.h"
#include "services/formats/files/agreement_proto.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/pcd/scan_file.h"
#include "services/work/pipeline/frame_inputs.h"
#include "services/work/pipeline/moved_views.h"
#include "services/work/pipeline/stage_reports.h"

namespace weft {
namespace {

// Shares of a frame's work after which the stages end; decoding takes nearly all of it.
constexpr double kDecoded = 0.85;
constexpr double kTriangulated = 0.92;

// From this share on, cells that the template lacks say that it is another one; fewer cells say nothing.
constexpr double kForeign = 0.5;
constexpr int kTellingCells = 50;

// Relative tolerance of the alignment that only says where to look again. 1e-4 finds .2 points more of the
// cells of 3 to 4 px of pleats, .1 of gathers (docs/decoding-accuracy-history.md), and takes 0.7 s longer
// where 100,000 vertices take 3 s.
constexpr double kRoughTolerance = 5e-4;

// Share of the centres that a round of the second pass has to add for another one, and rounds at most. First
// rounds of pleats and gathers add 7 to 15 %, second ones 0.8 to 2.6 %, third ones less
// (docs/decoding-accuracy-history.md).
constexpr double kManyFinds = 0.03;
constexpr int kMostRounds = 3;

absl::Status CheckStop(const std::stop_token& stop) {
  return stop.stop_requested() ? absl::CancelledError("the registration was cancelled") : absl::OkStatus();
}

// Adds the time since the last call, or since construction, to the report.
class StageClock {
 public:
  explicit StageClock(v1::FrameReport& report) : report_(report) {}

  // Takes the place of an earlier time of the stage.
  void End(const char* stage) {
    auto& stages = *report_.mutable_stages();
    const auto earlier =
        std::ranges::find_if(stages, [stage](const v1::StageTime& time) { return time.stage() == stage; });
    v1::StageTime& time = earlier == stages.end() ? *stages.Add() : *earlier;
    time.set_stage(stage);
    time.set_time_ms(watch_.Ms());
    watch_ = {};
  }

 private:
  v1::FrameReport& report_;
  Stopwatch watch_;
};

// For a second pass, and for observations of another moment than the frame's.
struct DecodedViews {
  std::vector<std::unique_ptr<ViewDecoder>> decoders;
  MovedViews moved;
};

// Decodes all views into the members of `frame`.
DecodedViews DecodeViews(const RegistrationInputs& inputs, size_t index, const FrameOptions& options,
                         const FrameProgress& progress, const std::stop_token& stop, FrameResult& frame) {
  const FrameProgress part = [&](double share) {
    if (progress) progress(kDecoded * share);
  };
  std::optional<size_t> kept_image_bytes;
  if (options.pipeline.second_pass.enabled) kept_image_bytes = options.kept_image_bytes;
  const FrameImages images{inputs.rig, inputs.board, *inputs.dump, index};
  DecodedFrame decoded =
      DecodeFrame(kAllStages, images, options.pipeline.decode, kept_image_bytes, part, stop);
  MovedViews moved = MovedViews::Decode(images, options.pipeline.decode, stop, decoded);
  moved.Move(decoded.views);
  moved.Describe(decoded.reports);
  frame.views = std::move(decoded.views);
  int missing = 0;
  for (v1::ViewReport& report : decoded.reports) {
    missing += !report.missing_reason().empty();
    *frame.report.add_views() = std::move(report);
  }
  frame.report.set_views_missing(missing);
  frame.report.set_views_used(frame.report.views_size() - missing);
  return {std::move(decoded.decoders), std::move(moved)};
}

// Empty where the folder has no scan of the frame.
absl::StatusOr<ScanFile> ReadScanOf(const RegistrationInputs& inputs, size_t index,
                                    const std::string& scans) {
  const std::string path = ScanPath(inputs.dump->frame_names()[index], scans);
  return path.empty() ? ScanFile() : ReadScan(path);
}

// Empty where the folder has no mesh of the frame.
absl::StatusOr<std::vector<Eigen::Vector3d>> ReadStartOf(const RegistrationInputs& inputs, size_t index,
                                                         const std::string& starts) {
  const std::string path = StartPath(inputs.dump->frame_names()[index], starts);
  if (path.empty()) return std::vector<Eigen::Vector3d>();
  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, ReadMesh(path));
  if (absl::Status status = CheckStartMesh(mesh, inputs.garment.rest); !status.ok())
    return Naming(path, status);
  return std::move(mesh.vertices_mm);
}

// What a frame brings besides images.
struct Extras {
  ScanFile scan;
  std::vector<Eigen::Vector3d> start_mm;
};
absl::StatusOr<Extras> ReadExtrasOf(const RegistrationInputs& inputs, size_t index,
                                    const FrameOptions& options) {
  WEFT_ASSIGN_OR_RETURN(ScanFile scan, ReadScanOf(inputs, index, options.scans));
  WEFT_ASSIGN_OR_RETURN(std::vector<Eigen::Vector3d> start_mm, ReadStartOf(inputs, index, options.starts));
  return Extras{std::move(scan), std::move(start_mm)};
}

// From observations to mesh, in the members of `frame`.
class Registration {
 public:
  Registration(const RegistrationInputs& inputs, const FrameOptions& options, const Extras& extras,
               const std::stop_token& stop, FrameResult& frame)
      : inputs_(inputs), options_(options), extras_(extras), stop_(stop), frame_(frame) {}

  absl::Status Triangulate() {
    absl::StatusOr<Cloud> cloud = TriangulateFrame(kAllStages, inputs_.rig, inputs_.camera_sigma_px,
                                                   frame_.views, options_.pipeline.cloud);
    if (cloud.ok()) frame_.cloud = *std::move(cloud);
    return cloud.status();
  }

  // Adds the finds of the second pass to observations and cloud, in rounds while they are many: each time the
  // mesh is nearer to the folds that were missed. Nothing to be done for frames that cannot be registered.
  absl::Status LookAgain(size_t index, DecodedViews decoded) {
    // Only where to look is asked of this mesh. It follows from the cloud alone, so that another alignment
    // later leaves observations and cloud as they are.
    AlignOptions rough;
    rough.remove_self_intersections = false;
    rough.elastic.tolerance = kRoughTolerance;
    for (int round = 1;; ++round) {
      const absl::StatusOr<AlignResult> aligned = AlignCloud(rough, nullptr);
      if (!aligned.ok())
        return absl::IsFailedPrecondition(aligned.status()) ? absl::OkStatus() : aligned.status();
      const RegisteredMesh& mesh = aligned->mesh;
      if (round == 1) {
        observed_at_first_ = static_cast<int>(std::ranges::count(mesh.state, VertexState::kObserved));
      }
      decoded.moved.Undo(frame_.views);  // it adds to what was decoded
      WEFT_ASSIGN_OR_RETURN(const SecondPassResult pass,
                            SecondPass(kAllStages, {inputs_, index, mesh, options_.pipeline.second_pass},
                                       stop_, decoded.decoders, &frame_.views, frame_.report));
      frame_.report.set_second_pass_rounds(round);
      decoded.moved.Move(frame_.views);
      const bool goes_on = pass.added_share >= kManyFinds && round < kMostRounds;
      if (!goes_on) decoded.decoders.clear();  // what follows needs other memory
      const absl::Status status = pass.changed ? Triangulate() : absl::OkStatus();
      if (!status.ok() || !goes_on) return status;
    }
  }

  // What observations and cloud say. The cloud is from now on as its file has it.
  absl::Status Describe() {
    v1::FrameReport& report = frame_.report;
    frame_.cloud = AsInFile(std::move(frame_.cloud));
    DescribeCloud(frame_.cloud, *report.mutable_cloud());
    const TriangulationOptions& triangulation = options_.pipeline.cloud.triangulation;
    WEFT_ASSIGN_OR_RETURN(const auto biases,
                          MeasureCameraBias(inputs_.rig, frame_.views, frame_.cloud, triangulation));
    WEFT_ASSIGN_OR_RETURN(const auto agreements,
                          MeasureCameraAgreement(inputs_.rig, frame_.views, frame_.cloud, triangulation));
    for (int v = 0; v < report.views_size(); ++v) {
      const int camera = frame_.views[v].camera;
      DescribeBias(biases[camera], *report.mutable_views(v));
      DescribeAgreement(agreements[camera], inputs_.rig, *report.mutable_views(v));
    }
    DescribeScale(frame_.cloud, inputs_.board.board(), inputs_.garment, *report.mutable_cloud());
    for (std::string& camera : inputs_.dump->unknown_cameras()) report.add_unknown_cameras(std::move(camera));
    report.mutable_mesh()->set_observed_at_first_look(observed_at_first_);
    return absl::OkStatus();
  }

  // Mesh, state and reason of the frame, from its cloud.
  absl::Status Align() {
    v1::FrameReport& report = frame_.report;
    const int observed_at_first = report.mesh().observed_at_first_look();
    report.clear_mesh();
    report.clear_reason();
    for (v1::ViewReport& view : *report.mutable_views())
      view.clear_vertices_in_view(), view.clear_vertices_seen();
    report.set_state(v1::FRAME_STATE_FAILED);
    if (frame_.cloud.points.empty()) {
      report.set_reason(NoCloudReason(frame_.views, {report.views().begin(), report.views().end()},
                                      options_.pipeline.cloud.triangulation.consensus.min_views));
      return absl::OkStatus();
    }
    absl::StatusOr<AlignResult> aligned = AlignCloud(options_.pipeline.alignment, &extras_);
    if (absl::IsFailedPrecondition(aligned.status())) {
      report.set_reason(WithStrangers(std::string(aligned.status().message())));
      return absl::OkStatus();
    }
    if (!aligned.ok()) return aligned.status();
    DescribeAlignment(*aligned, inputs_.garment, unclaimed_, *report.mutable_mesh());
    if (const auto place = FindOtherPlace(inputs_.garment, inputs_.board.board(), frame_.cloud))
      DescribePlace(*place, *report.mutable_mesh()->mutable_map_fits());
    if (extras_.scan.points > 0)
      DescribeScan(extras_.scan, aligned->scan, *report.mutable_mesh()->mutable_scan());
    report.mutable_mesh()->set_observed_at_first_look(observed_at_first);
    frame_.mesh = std::move(aligned->mesh);
    DescribeInView();
    report.set_state(report.views_missing() > 0 ? v1::FRAME_STATE_DEGRADED : v1::FRAME_STATE_DONE);
    if (report.views_missing() > 0) {
      report.set_reason(
          absl::StrCat(report.views_missing(), " of ", report.views_size(), " cameras have no usable image"));
    }
    return absl::OkStatus();
  }

 private:
  // How much of the cloth in its view each camera saw.
  void DescribeInView() {
    const std::vector<ClothInView> in_view =
        CountClothInView(inputs_.rig, frame_.views, inputs_.garment, *frame_.mesh);
    for (size_t v = 0; v < in_view.size(); ++v) {
      v1::ViewReport& view = *frame_.report.mutable_views(static_cast<int>(v));
      view.set_vertices_in_view(in_view[v].vertices);
      view.set_vertices_seen(in_view[v].seen);
    }
  }

  // `extras` may be null.
  absl::StatusOr<AlignResult> AlignCloud(const AlignOptions& options, const Extras* extras) {
    const CloudTargets targets = TargetsFromCloud(inputs_.garment, frame_.cloud);
    unclaimed_ = targets.unclaimed;
    const bool has_scan = extras && extras->scan.points > 0;
    const bool has_start = extras && !extras->start_mm.empty();
    const AlignContext context{.rays = &targets.rays,
                               .scan = has_scan ? &extras->scan.scan : nullptr,
                               .start_mm = has_start ? &extras->start_mm : nullptr,
                               .cancelled = [this] { return stop_.stop_requested(); }};
    return weft::Align(*inputs_.model, targets.targets, options, context);
  }

  // Cells of the board that the template lacks explain why too few of its vertices were measured.
  std::string WithStrangers(std::string reason) const {
    const int centers = frame_.report.cloud().centers();
    if (unclaimed_ < kForeign * centers || centers < kTellingCells) return reason;
    return absl::StrCat(unclaimed_, " of the ", centers,
                        " cells that were triangulated are on the board but not on the template; is it the "
                        "template of another part of the board? (",
                        reason, ")");
  }

  const RegistrationInputs& inputs_;
  const FrameOptions& options_;
  const Extras& extras_;
  const std::stop_token& stop_;
  FrameResult& frame_;
  int unclaimed_ = 0, observed_at_first_ = 0;
};

}  // namespace

absl::StatusOr<FrameResult> ComputeFrame(const RegistrationInputs& inputs, size_t index,
                                         const FrameOptions& options, const FrameProgress& progress,
                                         std::stop_token stop) {
  FrameResult frame;
  StageClock clock(frame.report);
  DecodedViews decoded = DecodeViews(inputs, index, options, progress, stop, frame);
  clock.End("decode");
  ReleasePixels();  // what follows needs other memory
  WEFT_RETURN_IF_ERROR(CheckStop(stop));
  WEFT_ASSIGN_OR_RETURN(const Extras extras, ReadExtrasOf(inputs, index, options));

  Registration registration(inputs, options, extras, stop, frame);
  WEFT_RETURN_IF_ERROR(registration.Triangulate());
  clock.End("triangulate");
  if (progress) progress(kTriangulated);
  WEFT_RETURN_IF_ERROR(CheckStop(stop));
  if (options.pipeline.second_pass.enabled) {
    WEFT_RETURN_IF_ERROR(registration.LookAgain(index, std::move(decoded)));
    clock.End("second pass");
  }
  WEFT_RETURN_IF_ERROR(registration.Describe());
  WEFT_RETURN_IF_ERROR(registration.Align());
  clock.End("align");
  return frame;
}

absl::Status AlignFrame(const RegistrationInputs& inputs, size_t index, const FrameOptions& options,
                        std::stop_token stop, FrameResult& frame) {
  StageClock clock(frame.report);
  WEFT_ASSIGN_OR_RETURN(const Extras extras, ReadExtrasOf(inputs, index, options));
  Registration registration(inputs, options, extras, stop, frame);
  WEFT_RETURN_IF_ERROR(registration.Align());
  clock.End("align");
  return absl::OkStatus();
}

}  // namespace weft
