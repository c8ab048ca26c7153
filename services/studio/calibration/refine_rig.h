// `weft rig refine`: a rig corrected by the cloth that a registration decoded.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/calibration/rig_refinement.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/verdict/camera_checks.h"
#include "weft/v1/calibration.pb.h"

namespace weft {

struct RefinementRequest {
  std::string result;  // of a registration with --observations
  std::string rig;     // the rig.json that it was registered with
  std::string out;     // the rig.json to write
  int frames = 20;     // spread over those of the result
  int points = 2000;   // of a frame, spread over the board
  // Of an observation per axis, where observations.csv does not tell: files up to version 0.1.2.
  double sigma_px = 0.1;
  // Rays of a knocked camera miss the point by some distance; how far they may.
  double radius_mm = 4;
  RigRefinementOptions solve;

  absl::Status Validate() const;
};

// Of a bad verdict `rig` is not to be written: cameras were exchanged, or the poses did not settle.
struct RefinementResult {
  Rig before, rig;
  RefinedRig refined;
  std::vector<CameraStanding> standings;  // [cameras], before the correction
  std::vector<std::string> frames;
  std::optional<CalibrationRecord> record;  // of the rig before, brought up to date; empty where it had none
  std::string provenance;
};

// Triangulates the cells of the frames anew and refines all poses. Errors name the file; NotFound: the result
// holds no observations; FailedPrecondition as RefineRig. `on_progress` (may be empty) receives the share
// done.
absl::StatusOr<RefinementResult> RefineRigFromResult(const RefinementRequest& request,
                                                     const std::function<void(double)>& on_progress = {});

// Of all sights, after the correction.
double RmsAfterPx(const RefinementResult& result);
// By the limits of docs/verdicts.md.
v1::Verdict RefinementVerdict(const RefinementResult& result);
v1::RigRefinementReport RefinementReport(const RefinementResult& result);
// "camera c07 moved: turned by 0.050 deg, shifted by 0.1 mm, it saw the cloth 2.3 px off"; a line per camera
// that did, then one on the rest.
std::vector<std::string> RefinementText(const RefinementResult& result);

}  // namespace weft
