#include "services/studio/calibration/refine_rig.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "services/formats/files/agreement_proto.h"
#include "services/formats/files/frame_folders.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/observations_file.h"
#include "services/results/report/camera_facts.h"
#include "triangulation/camera_agreement.h"
#include "triangulation/triangulate.h"

namespace weft {
namespace {

absl::StatusOr<std::vector<std::string>> ChooseFrames(const RefinementRequest& request) {
  WEFT_ASSIGN_OR_RETURN(std::vector<std::string> all,
                        ListFrameFolders(request.result, FrameFile::kObservations));
  if (all.empty()) {
    return absl::NotFoundError(absl::StrCat(
        request.result, ": no frame has an observations.csv; register the take with --observations"));
  }
  std::vector<std::string> chosen;
  const size_t count = std::min(all.size(), static_cast<size_t>(request.frames));
  for (size_t i = 0; i < count; ++i) chosen.push_back(all[i * all.size() / count]);
  return chosen;
}

absl::StatusOr<std::vector<ViewObservations>> ReadViews(const std::string& path, const Rig& rig,
                                                        double unknown_sigma_px) {
  WEFT_ASSIGN_OR_RETURN(std::vector<ImageObservations> images, ReadObservations(path));
  std::vector<ViewObservations> views;
  for (ImageObservations& image : images) {
    const int camera = rig.IndexOf(image.image);
    if (camera < 0) {
      return absl::InvalidArgumentError(absl::StrCat(
          path, ": camera ", image.image, " is not in the rig; give the rig that the take was made with"));
    }
    for (Observation& o : image.observations) {
      if (o.sigma_px == 0) o.sigma_px = static_cast<float>(unknown_sigma_px);
    }
    views.push_back({camera, std::move(image.observations)});
  }
  return views;
}

// What all frames give to RefineRig.
struct Sights {
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<PointSight> sights;
  std::vector<v1::FrameReport> reports;  // of each frame, with the agreement of its cameras
};

absl::Status AddAgreement(const Rig& rig, const std::vector<ViewObservations>& views, const Cloud& cloud,
                          const TriangulationOptions& options, Sights* sights) {
  WEFT_ASSIGN_OR_RETURN(const auto agreements, MeasureCameraAgreement(rig, views, cloud, options));
  v1::FrameReport& report = sights->reports.emplace_back();
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    v1::ViewReport& view = *report.add_views();
    view.set_camera(rig.cameras[c].id);
    DescribeAgreement(agreements[c], rig, view);
  }
  return absl::OkStatus();
}

// Those of cameras that agree with no other would pull the others to them.
void DropApart(const std::vector<CameraStanding>& standings, std::vector<PointSight>* sights) {
  std::erase_if(*sights, [&](const PointSight& sight) { return IsApart(standings[sight.camera]); });
}

absl::Status AddFrame(const RefinementRequest& request, const Rig& rig, const std::string& frame,
                      Sights* sights) {
  const std::string path = FramePaths(request.result, frame).Of(FrameFile::kObservations);
  WEFT_ASSIGN_OR_RETURN(const auto views, ReadViews(path, rig, request.sigma_px));
  TriangulationOptions options;
  options.consensus.inlier_radius_mm = request.radius_mm;
  // A knocked camera is far off in pixels, however precise its observations are.
  options.consensus.min_residual_px = request.solve.max_residual_px;
  options.two_view.accept = false;
  WEFT_ASSIGN_OR_RETURN(const Cloud cloud, Naming(path, Triangulate(rig, views, options)));
  WEFT_RETURN_IF_ERROR(AddAgreement(rig, views, cloud, options, sights));
  const size_t step = std::max<size_t>(1, cloud.points.size() / request.points);
  std::map<BoardNode, int> index;
  for (size_t i = 0; i < cloud.points.size(); i += step) {
    index[cloud.points[i].node] = static_cast<int>(sights->points_mm.size());
    sights->points_mm.push_back(cloud.points[i].position_mm);
  }
  for (const ViewObservations& view : views) {
    for (const Observation& o : view.observations) {
      const auto point = index.find(o.node);
      if (point == index.end()) continue;
      const double sigma_px = std::max<double>(o.sigma_px, options.refinement.min_sigma_px);
      sights->sights.push_back({view.camera, point->second, {o.x_px, o.y_px}, sigma_px});
    }
  }
  return absl::OkStatus();
}

absl::Status UpdateRecord(const RefinementRequest& request, RefinementResult* result) {
  WEFT_ASSIGN_OR_RETURN(result->record, ReadCalibrationRecord(request.rig));
  if (!result->record) return absl::OkStatus();
  ++result->record->version;
  result->record->replaces = result->before.ContentHash();
  result->record->calibrated_utc = UtcText();
  for (size_t c = 0; c < result->record->cameras.size(); ++c) {
    const CameraCorrection& correction = result->refined.corrections[c];
    if (correction.held) continue;
    for (int i = 0; i < 6; ++i)
      result->record->cameras[c].sigmas[9 + i] = std::sqrt(correction.covariance(i, i));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status RefinementRequest::Validate() const {
  if (frames < 1) return absl::InvalidArgumentError("frames must be at least 1");
  if (points < 100) return absl::InvalidArgumentError("points must be at least 100");
  if (!(sigma_px > 0)) return absl::InvalidArgumentError("sigma_px must be positive");
  if (!(radius_mm > 0)) return absl::InvalidArgumentError("radius_mm must be positive");
  return solve.Validate();
}

absl::StatusOr<RefinementResult> RefineRigFromResult(const RefinementRequest& request,
                                                     const std::function<void(double)>& on_progress) {
  WEFT_RETURN_IF_ERROR(request.Validate());
  WEFT_ASSIGN_OR_RETURN(Rig rig, ReadRig(request.rig));
  WEFT_ASSIGN_OR_RETURN(std::vector<std::string> frames, ChooseFrames(request));
  Sights sights;
  for (size_t f = 0; f < frames.size(); ++f) {
    WEFT_RETURN_IF_ERROR(AddFrame(request, rig, frames[f], &sights));
    if (on_progress) on_progress(0.7 * static_cast<double>(f + 1) / static_cast<double>(frames.size()));
  }
  std::vector<CameraStanding> standings = FactsOf(sights.reports).cameras;
  DropApart(standings, &sights.sights);
  absl::StatusOr<RefinedRig> refined = RefineRig(rig, sights.points_mm, sights.sights, request.solve);
  if (!refined.ok()) {
    const CameraFault fault = FaultOf(standings);
    if (!fault.is_named) return refined.status();
    return absl::FailedPreconditionError(absl::StrCat(fault.reason, "; ", fault.remedy));
  }
  RefinementResult result;
  result.before = rig;
  result.rig = std::move(rig);
  result.rig.cameras = refined->cameras;
  result.refined = *std::move(refined);
  result.standings = std::move(standings);
  result.frames = std::move(frames);
  WEFT_RETURN_IF_ERROR(UpdateRecord(request, &result));
  result.provenance = absl::StrFormat(
      "rig %s (%s) refined from the cloth in %d frames of %s", result.before.id, result.before.ContentHash(),
      result.frames.size(), std::filesystem::path(request.result).lexically_normal().filename().string());
  if (on_progress) on_progress(1);
  return result;
}

v1::RigRefinementReport RefinementReport(const RefinementResult& result) {
  v1::RigRefinementReport report;
  report.set_frames(static_cast<int>(result.frames.size()));
  report.set_points(static_cast<int>(result.refined.points_mm.size()));
  report.set_converged(result.refined.converged);
  report.set_rig_hash_before(result.before.ContentHash());
  report.set_rig_hash(result.rig.ContentHash());
  *report.mutable_verdict() = RefinementVerdict(result);
  report.set_written(report.verdict().grade() != v1::GRADE_BAD);
  for (size_t c = 0; c < result.rig.cameras.size(); ++c) {
    const CameraCorrection& correction = result.refined.corrections[c];
    v1::RigRefinementReport::Camera& camera = *report.add_cameras();
    camera.set_id(result.rig.cameras[c].id);
    camera.set_sights(correction.sights);
    camera.set_held(correction.held);
    camera.set_moved(correction.moved);
    camera.set_rotation_deg(correction.rotation_deg);
    camera.set_rotation_sigma_deg(correction.rotation_sigma_deg);
    camera.set_center_mm(correction.center_mm);
    camera.set_center_sigma_mm(correction.center_sigma_mm);
    camera.set_shift_px(correction.shift_px);
    camera.set_before_rms_px(correction.before_rms_px);
    camera.set_after_rms_px(correction.after_rms_px);
    camera.set_misfit(correction.misfit);
    camera.set_after_median_px(correction.after_median_px);
  }
  return report;
}

std::vector<std::string> RefinementText(const RefinementResult& result) {
  std::vector<std::string> lines, held;
  double before = 0, sights = 0;
  for (size_t c = 0; c < result.rig.cameras.size(); ++c) {
    const CameraCorrection& correction = result.refined.corrections[c];
    const std::string& id = result.rig.cameras[c].id;
    if (correction.misfit) {
      held.push_back(absl::StrFormat("camera %s: no pose puts it right, it stays as it was", id));
      continue;
    }
    before += correction.sights * std::pow(correction.before_rms_px, 2);
    sights += correction.sights;
    if (correction.held && IsApart(result.standings[c])) {
      held.push_back(absl::StrCat("camera ", id, ": takes no part, it stays as it was"));
    } else if (correction.held) {
      held.push_back(absl::StrFormat("camera %s: only %d sights of the cloth, it stays as it was", id,
                                     correction.sights));
    }
    if (!correction.moved) continue;
    lines.push_back(absl::StrFormat(
        "camera %s moved: turned by %.4f deg (sigma %.4f), centre by %.2f mm (sigma %.2f); it saw the cloth "
        "%.2f px off",
        id, correction.rotation_deg, correction.rotation_sigma_deg, correction.center_mm,
        correction.center_sigma_mm, correction.shift_px));
  }
  if (lines.empty()) lines.push_back("no camera moved");
  lines.insert(lines.end(), held.begin(), held.end());
  lines.push_back(absl::StrFormat("%d points of %d frames: reprojection error %.3f px before, %.3f px now",
                                  result.refined.points_mm.size(), result.frames.size(),
                                  std::sqrt(before / sights), RmsAfterPx(result)));
  return lines;
}

}  // namespace weft
