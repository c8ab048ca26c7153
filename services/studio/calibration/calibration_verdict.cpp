// What a calibration and a refinement are worth.
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/median.h"
#include "services/formats/verdict/verdict.h"
#include "services/studio/calibration/calibrate_dump.h"
#include "services/studio/calibration/refine_rig.h"

namespace weft {
namespace {

// Messages of issues end with "; " and what to do.
void AddRefusal(const std::vector<CalibrationIssue>& issues, v1::Verdict& verdict) {
  const std::string& message = issues.front().message;
  const size_t end = message.rfind("; ");
  std::string remedy = end == std::string::npos ? "fix that and calibrate again" : message.substr(end + 2);
  remedy[0] = absl::ascii_toupper(static_cast<unsigned char>(remedy[0]));
  if (remedy.back() != '?') remedy += '.';
  if (issues.size() > 1) remedy += " The other causes follow.";
  AddFinding(verdict, v1::GRADE_BAD, message.substr(0, end), remedy);
}

// A pose that comes near would hide what is wrong with the camera.
void AddMisfits(const RefinementResult& result, v1::Verdict& verdict) {
  std::vector<double> usual_px;
  for (const CameraCorrection& correction : result.refined.corrections)
    if (!correction.held) usual_px.push_back(correction.after_median_px);
  const double usual = Median(std::move(usual_px));
  for (size_t c = 0; c < result.before.cameras.size(); ++c) {
    const CameraCorrection& correction = result.refined.corrections[c];
    if (!correction.misfit) continue;
    const std::string& id = result.before.cameras[c].id;
    AddFinding(
        verdict, v1::GRADE_USABLE,
        absl::StrFormat("no pose of camera %s explains its images: they stay %.2g px off, those of "
                        "most cameras %.2g px",
                        id, correction.after_median_px, usual),
        "See whether its images are late or repeated: `weft take sync` tells of a take. Where its lens or "
        "its zoom was changed, calibrate again.");
  }
}

}  // namespace

WorstCamera WorstCameraOf(const CalibrationResult& result) {
  WorstCamera worst;
  for (size_t c = 0; c < result.solution->cameras.size(); ++c) {
    const double sigma_px = result.solution->cameras[c].projection_sigma_px;
    if (std::isfinite(sigma_px) && (worst.id.empty() || sigma_px > worst.sigma_px))
      worst = {result.detection.views.cameras[c].id, sigma_px};
  }
  return worst;
}

std::string CalibrationHeadline(const CalibrationResult& result) {
  if (!result.issues.empty()) {
    const size_t reasons = result.issues.size();
    return absl::StrCat("Calibration refused for ", reasons, reasons == 1 ? " reason" : " reasons");
  }
  const WorstCamera worst = WorstCameraOf(result);
  return absl::StrFormat(
      "%d cameras from %d frames: reprojection error %.3f px; projection uncertainty up to %.3f px (%s)",
      result.detection.views.cameras.size(), result.detection.views.frames.size(), result.solution->rms_px,
      worst.sigma_px, worst.id);
}

v1::Verdict CalibrationVerdict(const CalibrationResult& result) {
  v1::Verdict verdict;
  if (!result.issues.empty()) {
    AddRefusal(result.issues, verdict);
    return verdict;
  }
  AddFinding(verdict, v1::GRADE_GOOD, CalibrationHeadline(result), "");
  AddCheck(verdict, kCalibrationReprojection, result.solution->rms_px);
  const WorstCamera worst = WorstCameraOf(result);
  AddCheck(
      verdict, kCalibrationUncertainty, worst.sigma_px,
      absl::StrFormat("camera %s sees a known point of the stage to %.3f px only", worst.id, worst.sigma_px));
  return verdict;
}

double RmsAfterPx(const RefinementResult& result) {
  double sum = 0, sights = 0;
  for (const CameraCorrection& correction : result.refined.corrections) {
    if (correction.misfit) continue;
    sum += correction.sights * std::pow(correction.after_rms_px, 2);
    sights += correction.sights;
  }
  return std::sqrt(sum / sights);
}

v1::Verdict RefinementVerdict(const RefinementResult& result) {
  v1::Verdict verdict;
  int moved = 0, held = 0;
  for (size_t c = 0; c < result.refined.corrections.size(); ++c) {
    const CameraCorrection& correction = result.refined.corrections[c];
    moved += correction.moved ? 1 : 0;
    held += correction.held && !correction.misfit && !IsApart(result.standings[c]) ? 1 : 0;
  }
  AddFinding(verdict, v1::GRADE_GOOD,
             moved == 0   ? "no camera moved"
             : moved == 1 ? "1 camera moved and was corrected"
                          : absl::StrCat(moved, " cameras moved and were corrected"),
             "");
  if (const CameraFault fault = FaultOf(result.standings); !fault.reason.empty())
    AddFinding(verdict, fault.is_named ? v1::GRADE_BAD : v1::GRADE_USABLE, fault.reason, fault.remedy);
  AddMisfits(result, verdict);
  if (!result.refined.converged && moved == 0)
    AddFinding(verdict, v1::GRADE_USABLE, "the poses did not settle, though no camera moved",
               "Refine from more frames: --samples.");
  else if (!result.refined.converged)
    AddFinding(verdict, v1::GRADE_BAD, "the poses did not settle",
               "Calibrate again: too many cameras moved, or the rig is not that of the take.");
  if (held > 0)
    AddFinding(verdict, v1::GRADE_USABLE,
               absl::StrCat(held,
                            held == 1 ? " camera sees too little of the cloth and was"
                                      : " cameras see too little of the cloth and were",
                            " not evaluated"),
               "Register a take in which the cloth passes before it, with more --samples.");
  AddCheck(verdict, kCalibrationReprojection, RmsAfterPx(result));
  return verdict;
}

}  // namespace weft
