#include "services/pipeline/frame_stages.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "pattern/decoder.h"
#include "services/files/mesh_file.h"
#include "services/files/scan_file.h"
#include "services/pipeline/stage_reports.h"
#include "triangulation/clean.h"
#include "triangulation/footprint.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;

// Shares of a frame's work after which the stages end; decoding takes nearly all of it.
constexpr double kDecoded = 0.85;
constexpr double kTriangulated = 0.92;

double MillisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

absl::Status CheckStop(const std::stop_token& stop) {
  return stop.stop_requested() ? absl::CancelledError("the registration was cancelled") : absl::OkStatus();
}

// Adds the time since the last call, or since construction, to the report.
class StageClock {
 public:
  explicit StageClock(v1::FrameReport& report) : report_(report) {}

  void End(const char* stage) {
    v1::StageTime& time = *report_.add_stages();
    time.set_stage(stage);
    time.set_time_ms(MillisecondsSince(start_));
    start_ = Clock::now();
  }

 private:
  v1::FrameReport& report_;
  Clock::time_point start_ = Clock::now();
};

std::vector<Observation> DecodeCamera(const RegistrationInputs& inputs, size_t index, size_t camera,
                                      v1::ViewReport& report) {
  report.set_camera(inputs.rig.cameras[camera].id);
  const auto start = Clock::now();
  const absl::StatusOr<Frame> frame = inputs.dump->ReadView(index, camera);
  report.set_read_ms(MillisecondsSince(start));
  if (!frame.ok()) {
    report.set_missing_reason(std::string(frame.status().message()));
    return {};
  }
  absl::StatusOr<DecodeResult> result = DecodeView(*frame, inputs.board, DecodeOptions{});
  if (!result.ok()) {
    report.set_missing_reason(absl::StrCat(frame->origin, ": ", result.status().message()));
    return {};
  }
  DescribeDecoding(*result, report);
  return std::move(result->observations);
}

// One entry per camera of the rig, in its order.
void DecodeViews(const RegistrationInputs& inputs, size_t index, const FrameProgress& progress,
                 const std::stop_token& stop, FrameResult& frame) {
  const size_t cameras = inputs.rig.cameras.size();
  frame.views.resize(cameras);
  std::vector<v1::ViewReport> reports(cameras);
  std::atomic<size_t> done = 0;
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, cameras, 1),
      [&](const tbb::blocked_range<size_t>& range) {
        for (size_t camera = range.begin(); camera < range.end(); ++camera) {
          if (stop.stop_requested()) return;
          frame.views[camera].camera = static_cast<int>(camera);
          frame.views[camera].observations = DecodeCamera(inputs, index, camera, reports[camera]);
          if (progress) progress(kDecoded * static_cast<double>(++done) / static_cast<double>(cameras));
        }
      },
      tbb::simple_partitioner());
  int missing = 0;
  for (v1::ViewReport& report : reports) {
    missing += !report.missing_reason().empty();
    *frame.report.add_views() = std::move(report);
  }
  frame.report.set_views_missing(missing);
  frame.report.set_views_used(static_cast<int>(cameras) - missing);
}

// The reason why nothing could be triangulated.
std::string NoCloudReason(const v1::FrameReport& report, const TriangulationOptions& options) {
  int64_t seen = 0;
  for (const v1::ViewReport& view : report.views()) seen += view.centers();
  const int least = options.consensus.min_views;
  if (report.views_used() < least) {
    return absl::StrCat("only ", report.views_used(), " of ", report.views_size(),
                        " cameras have an image, triangulation needs ", least);
  }
  if (seen == 0)
    return "no cell of the board was decoded in any view; is it the printed board, and in focus?";
  return absl::StrCat("no cell could be triangulated from ", seen, " observations of cells");
}

// Empty where the folder has no scan of the frame.
absl::StatusOr<Scan> ReadScanOf(const RegistrationInputs& inputs, size_t index, const std::string& scans) {
  const std::string path = ScanPath(inputs, index, scans);
  return path.empty() ? Scan() : ReadScan(path);
}

// Empty where the folder has no mesh of the frame.
absl::StatusOr<std::vector<Eigen::Vector3d>> ReadStartOf(const RegistrationInputs& inputs, size_t index,
                                                         const std::string& starts) {
  const std::string path = StartPath(inputs, index, starts);
  if (path.empty()) return std::vector<Eigen::Vector3d>();
  absl::StatusOr<TriangleMesh> mesh = ReadMesh(path);
  if (!mesh.ok()) return mesh.status();
  if (mesh->vertices_mm.size() != inputs.garment.rest.vertices_mm.size()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": has ", mesh->vertices_mm.size(),
                                                   " vertices, the template ",
                                                   inputs.garment.rest.vertices_mm.size()));
  }
  return std::move(mesh->vertices_mm);
}

// What a frame brings besides images.
struct Extras {
  Scan scan;
  std::vector<Eigen::Vector3d> start_mm;
};
absl::StatusOr<Extras> ReadExtrasOf(const RegistrationInputs& inputs, size_t index,
                                    const FrameOptions& options) {
  absl::StatusOr<Scan> scan = ReadScanOf(inputs, index, options.scans);
  if (!scan.ok()) return scan.status();
  absl::StatusOr<std::vector<Eigen::Vector3d>> start_mm = ReadStartOf(inputs, index, options.starts);
  if (!start_mm.ok()) return start_mm.status();
  return Extras{*std::move(scan), *std::move(start_mm)};
}

// From observations to mesh, in the members of `frame`.
class Registration {
 public:
  Registration(const RegistrationInputs& inputs, const FrameOptions& options, const Extras& extras,
               const std::stop_token& stop, FrameResult& frame)
      : inputs_(inputs), options_(options), extras_(extras), stop_(stop), frame_(frame) {}

  absl::Status Triangulate() {
    absl::StatusOr<Cloud> cloud = weft::Triangulate(inputs_.rig, frame_.views, TriangulationOptions{});
    if (!cloud.ok()) return cloud.status();
    frame_.cloud = SharpenCenters(CleanCloud(*std::move(cloud), CleaningOptions{}), FootprintOptions{});
    return absl::OkStatus();
  }

  // Adds what the second look finds to observations and cloud. Nothing to be done for frames that cannot be
  // registered.
  absl::Status LookAgain(size_t index) {
    // Only where to look is asked of this mesh.
    AlignOptions rough = options_.align;
    rough.remove_self_intersections = false;
    const absl::StatusOr<AlignResult> first = AlignCloud(rough);
    if (!first.ok()) return absl::IsFailedPrecondition(first.status()) ? absl::OkStatus() : first.status();
    std::vector<v1::ViewReport*> reports;
    for (v1::ViewReport& report : *frame_.report.mutable_views()) reports.push_back(&report);
    const absl::StatusOr<int> added = weft::LookAgain(inputs_, index, first->mesh, options_.second, stop_,
                                                      &frame_.views, std::move(reports));
    if (!added.ok()) return added.status();
    observed_at_first_ = static_cast<int>(
        std::count(first->mesh.state.begin(), first->mesh.state.end(), VertexState::kObserved));
    return *added > 0 ? Triangulate() : absl::OkStatus();
  }

  // Mesh, state and reason of the frame.
  absl::Status Align() {
    v1::FrameReport& report = frame_.report;
    DescribeCloud(frame_.cloud, *report.mutable_cloud());
    const auto biases = MeasureCameraBias(inputs_.rig, frame_.views, frame_.cloud, CameraBiasOptions{});
    if (!biases.ok()) return biases.status();
    for (int v = 0; v < report.views_size(); ++v)
      DescribeBias((*biases)[frame_.views[v].camera], *report.mutable_views(v));
    report.set_state(v1::FRAME_STATE_FAILED);
    if (frame_.cloud.points.empty()) {
      report.set_reason(NoCloudReason(report, TriangulationOptions{}));
      return absl::OkStatus();
    }
    absl::StatusOr<AlignResult> aligned = AlignCloud(options_.align);
    if (absl::IsFailedPrecondition(aligned.status())) {
      report.set_reason(std::string(aligned.status().message()));
      return absl::OkStatus();
    }
    if (!aligned.ok()) return aligned.status();
    DescribeAlignment(*aligned, inputs_.garment, unclaimed_, *report.mutable_mesh());
    report.mutable_mesh()->set_observed_at_first_look(observed_at_first_);
    frame_.mesh = std::move(aligned->mesh);
    report.set_state(report.views_missing() > 0 ? v1::FRAME_STATE_DEGRADED : v1::FRAME_STATE_DONE);
    if (report.views_missing() > 0) {
      report.set_reason(
          absl::StrCat(report.views_missing(), " of ", report.views_size(), " cameras have no usable image"));
    }
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<AlignResult> AlignCloud(const AlignOptions& options) {
    const CloudTargets targets = TargetsFromCloud(inputs_.garment, frame_.cloud);
    unclaimed_ = targets.unclaimed;
    const AlignContext context{.scan = extras_.scan.points_mm.empty() ? nullptr : &extras_.scan,
                               .start_mm = extras_.start_mm.empty() ? nullptr : &extras_.start_mm,
                               .cancelled = [this] { return stop_.stop_requested(); }};
    return weft::Align(*inputs_.model, targets.targets, options, context);
  }

  const RegistrationInputs& inputs_;
  const FrameOptions& options_;
  const Extras& extras_;
  const std::stop_token& stop_;
  FrameResult& frame_;
  int unclaimed_ = 0, observed_at_first_ = 0;
};

}  // namespace

std::string ScanPath(const RegistrationInputs& inputs, size_t index, const std::string& scans) {
  if (scans.empty()) return "";
  for (const char* ending : {".ply", ".pcd"}) {
    const std::filesystem::path path =
        std::filesystem::path(scans) / (inputs.dump->frame_names()[index] + ending);
    std::error_code error;
    if (std::filesystem::exists(path, error)) return path.string();
  }
  return "";
}

std::string StartPath(const RegistrationInputs& inputs, size_t index, const std::string& starts) {
  if (starts.empty()) return "";
  const std::filesystem::path path =
      std::filesystem::path(starts) / inputs.dump->frame_names()[index] / "mesh.ply";
  std::error_code error;
  return std::filesystem::exists(path, error) ? path.string() : "";
}

absl::StatusOr<FrameResult> ComputeFrame(const RegistrationInputs& inputs, size_t index,
                                         const FrameOptions& options, const FrameProgress& progress,
                                         std::stop_token stop) {
  FrameResult frame;
  StageClock clock(frame.report);
  DecodeViews(inputs, index, progress, stop, frame);
  clock.End("decode");
  if (absl::Status status = CheckStop(stop); !status.ok()) return status;
  const absl::StatusOr<Extras> extras = ReadExtrasOf(inputs, index, options);
  if (!extras.ok()) return extras.status();

  Registration registration(inputs, options, *extras, stop, frame);
  if (absl::Status status = registration.Triangulate(); !status.ok()) return status;
  clock.End("triangulate");
  if (progress) progress(kTriangulated);
  if (absl::Status status = CheckStop(stop); !status.ok()) return status;
  if (options.second_look) {
    if (absl::Status status = registration.LookAgain(index); !status.ok()) return status;
    clock.End("second look");
  }
  if (absl::Status status = registration.Align(); !status.ok()) return status;
  clock.End("align");
  return frame;
}

}  // namespace weft
