// `weft rig calibrate`: from a dump of moved boards to a rig and what is known of it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/formats/files/rig_file.h"
#include "services/studio/calibration/detect_boards.h"
#include "weft/v1/calibration.pb.h"
#include "weft/v1/verdict.pb.h"

namespace weft {

struct CalibrationRequest {
  std::string dump;
  std::string target;       // target.json
  std::string initial_rig;  // lenses to start from; may be empty
  std::string out;          // the rig.json to write
  std::string rig_id;       // empty: that of the rig that `out` holds, or "rig"
  std::string mosaic;       // of grey image files (MosaicFromName); empty: none
  std::string frames;       // of the dump (FindFrameRange); empty: all
  int every = 1;            // frames apart
  TagDetectionOptions detection;
  SolveOptions solve;
  CalibrationCheckOptions checks;
};

// Everything that is known at the end, accepted or not.
struct CalibrationResult {
  CalibrationTarget target;
  BoardDetection detection;
  std::vector<CalibrationIssue> issues;         // none: accepted
  std::optional<CalibrationSolution> solution;  // empty where the views did not allow one
  Rig rig;                                      // of the solution
  CalibrationRecord record;
  std::string provenance;
  double detection_s = 0;
  double solution_s = 0;
};

// Detects, checks, solves, checks again; a solution that does not come about is an issue too. Errors name the
// file. `on_progress` (may be empty) receives a stage and its share done, from any thread; calls never
// overlap. Parallel in the calling thread's TBB arena.
absl::StatusOr<CalibrationResult> CalibrateDump(
    const CalibrationRequest& request,
    const std::function<void(const std::string&, double)>& on_progress = {});

// The camera that is the least sure where it sees a known point of the stage.
struct WorstCamera {
  std::string id;
  double sigma_px = 0;
};
// Of a result with a solution.
WorstCamera WorstCameraOf(const CalibrationResult& result);
// "8 cameras from 60 frames: reprojection error 0.019 px; projection uncertainty up to 0.013 px (c03)", or
// how many reasons speak against it.
std::string CalibrationHeadline(const CalibrationResult& result);
// Bad where it is refused; else by the limits of docs/verdicts.md.
v1::Verdict CalibrationVerdict(const CalibrationResult& result);

v1::CalibrationReport CalibrationMessage(const CalibrationResult& result);
// One page that loads nothing: what came out, what is wrong, coverage and residuals of every image, who sees
// what together, sigmas.
std::string MakeCalibrationReport(const CalibrationResult& result);
// The rig of an accepted result under `out`, and <out without .json>.report.{html,json} of any.
absl::Status WriteCalibration(const std::string& out, const CalibrationResult& result);
// Where WriteCalibration puts its page: "rig.json" gives "rig.report.html".
std::string CalibrationReportPath(const std::string& out);

}  // namespace weft
