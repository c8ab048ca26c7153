#include "services/studio/calibration/calibrate_dump.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "capture/take/frame_range.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/target_file.h"

namespace weft {
namespace {

using OnProgress = std::function<void(const std::string&, double)>;

absl::StatusOr<BoardDetection> Detect(const CalibrationRequest& request, const CalibrationTarget& target,
                                      const OnProgress& on_progress) {
  WEFT_ASSIGN_OR_RETURN(const Rig cameras, CamerasOfDump(request.dump));
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<FrameSource> source,
                        OpenDump(request.dump, cameras, request.mosaic));
  WEFT_ASSIGN_OR_RETURN(const FrameRange range,
                        FindFrameRange(request.frames, source->frame_names(), request.dump));
  std::vector<size_t> frames;
  for (size_t f = range.first; f < range.end; f += static_cast<size_t>(std::max(1, request.every)))
    frames.push_back(f);
  Mutex mutex;
  return DetectBoards(*source, cameras, target, request.detection, frames, [&](size_t done, size_t all) {
    const MutexLock lock(mutex);
    if (on_progress) on_progress("detect", static_cast<double>(done) / static_cast<double>(all));
  });
}

CalibratedCamera RecordOf(const CameraFit& fit) {
  CalibratedCamera camera;
  for (int i = 0; i < 15; ++i) camera.sigmas[i] = std::sqrt(fit.covariance(i, i));
  camera.projection_sigma_px = std::isfinite(fit.projection_sigma_px) ? fit.projection_sigma_px : 0;
  camera.corner_sigma_px = fit.sigma_px;
  camera.rms_px = fit.rms_px;
  camera.views = fit.views;
  camera.corners = fit.corners;
  return camera;
}

// The rig, and what its file says of the calibration; a file that stands there is counted on from.
absl::Status Record(const CalibrationRequest& request, CalibrationResult* result) {
  const CalibrationSolution& solution = *result->solution;
  result->rig.cameras = solution.bundle.cameras;
  result->rig.id = request.rig_id;
  CalibrationRecord& record = result->record;
  if (std::filesystem::exists(request.out)) {
    WEFT_ASSIGN_OR_RETURN(const Rig before, ReadRig(request.out));
    WEFT_ASSIGN_OR_RETURN(const std::optional<CalibrationRecord> old, ReadCalibrationRecord(request.out));
    record.version = (old.has_value() ? old->version : 0) + 1;
    record.replaces = before.ContentHash();
    if (result->rig.id.empty()) result->rig.id = before.id;
  }
  if (result->rig.id.empty()) result->rig.id = "rig";
  record.calibrated_utc = UtcText();
  record.rms_px = solution.rms_px;
  record.stage_low_mm = solution.stage_low_mm;
  record.stage_high_mm = solution.stage_high_mm;
  for (const CameraFit& fit : solution.cameras) record.cameras.push_back(RecordOf(fit));
  result->provenance =
      absl::StrFormat("calibrated from %d frames of %s with target %s, scale from %s",
                      static_cast<int>(result->detection.views.frames.size()),
                      std::filesystem::path(request.dump).lexically_normal().filename().string(),
                      result->target.id, request.solve.scale_from_bar ? "scale bars" : "tag sizes");
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<CalibrationResult> CalibrateDump(const CalibrationRequest& request,
                                                const OnProgress& on_progress) {
  absl::Status status = request.detection.Validate();
  status.Update(request.solve.Validate());
  status.Update(request.checks.Validate());
  if (!status.ok()) return status;
  CalibrationResult result;
  WEFT_ASSIGN_OR_RETURN(result.target, ReadTarget(request.target));
  std::optional<Rig> initial;
  if (!request.initial_rig.empty()) {
    WEFT_ASSIGN_OR_RETURN(initial, ReadRig(request.initial_rig));
  }
  const Stopwatch watch;
  WEFT_ASSIGN_OR_RETURN(result.detection, Detect(request, result.target, on_progress));
  result.detection_s = watch.Seconds();
  result.issues =
      CheckViews(result.target, result.detection.views, result.detection.sightings, request.checks);
  if (!result.issues.empty()) return result;

  const Stopwatch solve_watch;
  absl::StatusOr<CalibrationSolution> solution =
      SolveCalibration(result.target, result.detection.views, initial, request.solve, on_progress);
  result.solution_s = solve_watch.Seconds();
  if (!solution.ok()) {
    if (solution.status().code() != absl::StatusCode::kFailedPrecondition) return solution.status();
    result.issues.push_back({CalibrationFault::kUncertain, {}, std::string(solution.status().message())});
    return result;
  }
  result.solution = *std::move(solution);
  result.issues =
      CheckSolution(result.target, *result.solution, request.solve.scale_from_bar, request.checks);
  WEFT_RETURN_IF_ERROR(Record(request, &result));
  return result;
}

std::string CalibrationReportPath(const std::string& out) {
  std::filesystem::path path(out);
  if (path.extension() == ".json") path.replace_extension();
  return path.string() + ".report.html";
}

absl::Status WriteCalibration(const std::string& out, const CalibrationResult& result) {
  const std::filesystem::path folder = std::filesystem::path(out).parent_path();
  if (!folder.empty()) {
    WEFT_RETURN_IF_ERROR(CreateFolders(folder.string()));
  }
  WEFT_ASSIGN_OR_RETURN(const std::string json, ToJson(CalibrationMessage(result)));
  std::filesystem::path beside = CalibrationReportPath(out);
  absl::Status status = WriteFileAtomically(beside.string(), MakeCalibrationReport(result));
  status.Update(WriteFileAtomically(beside.replace_extension(".json").string(), json));
  if (!status.ok() || !result.issues.empty()) return status;
  return WriteRig(out, result.rig, result.provenance, &result.record);
}

}  // namespace weft
