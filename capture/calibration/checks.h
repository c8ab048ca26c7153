// What makes a calibration unfit for use, with the cause and the remedy in words.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "capture/calibration/board_view.h"
#include "capture/calibration/solve_calibration.h"
#include "capture/calibration/target.h"

namespace weft {

enum class CalibrationFault {
  kCameraUnseen,
  kMirroredImages,
  kMirroredBoard,
  kWrongLayout,
  kBlurred,
  kTooFewViews,
  kDisconnected,
  kPoorCoverage,
  kHighResidual,
  kWrongScale,
  kUncertain,
  kChanged,
  kWrongUnit,
};
// "camera_unseen" ...
std::string CalibrationFaultName(CalibrationFault fault);

struct CalibrationIssue {
  CalibrationFault fault = CalibrationFault::kCameraUnseen;
  std::vector<int> cameras;  // that it is about; empty: the whole rig
  std::string message;       // names cameras, numbers and the remedy
};

// What detection found in a camera's images.
struct CameraSightings {
  int images = 0;
  int tags = 0;
  int blurred_tags = 0;   // refused
  double blurred_px = 0;  // typical blur of those
  int small_tags = 0;     // refused
  int unclear_tags = 0;   // refused
  bool mirrored = false;  // its images show tags only when left and right are exchanged
  // Of a camera that saw no tag: sharpness of what moves in its images (MovingEdgeBlurPx); 0 where nothing
  // does.
  double moving_edge_px = 0;
};

struct CalibrationCheckOptions {
  int min_views = 8;                // of boards, of every camera
  int min_shared_views = 5;         // of those, that some other camera has as well
  int min_covered_cells = 6;        // of the 3 x 3 parts of every image, with corners in them
  double max_blurred_share = 0.5;   // of a camera's tags
  double max_moving_edge_px = 1.2;  // sharper ones in images without tags are not blamed for it
  double max_rms_px = 1;            // of a camera's residuals
  double max_rms_ratio = 4;         // of a camera's residuals to the median camera's, from 0.2 px on
  double max_scale_error = 0.005;   // of a scale bar, besides 4 of its sigmas
  double max_projection_sigma_px = 0.5;
  // Views that other cameras share and that do not fit: so many in a row, or this share of a camera's that is
  // far off. Good simulated recordings (calibration_test, NoMomentOfAGoodRecordingIsBlamed) have none in a
  // row.
  int min_changed_views = 5;
  double max_rejected_share = 0.2;

  absl::Status Validate() const;
};

// Corners in each of the 3 x 3 parts of a camera's images, row by row.
std::array<int, 9> CornerCoverage(const CalibrationViews& views, int camera);

// Before the solution: what would make it fail or mislead. `sightings` [cameras] may be empty.
std::vector<CalibrationIssue> CheckViews(const CalibrationTarget& target, const CalibrationViews& views,
                                         const std::vector<CameraSightings>& sightings,
                                         const CalibrationCheckOptions& options);

// After it.
std::vector<CalibrationIssue> CheckSolution(const CalibrationTarget& target,
                                            const CalibrationSolution& solution, bool scale_from_bar,
                                            const CalibrationCheckOptions& options);

// All of them in one FailedPrecondition; OK without any.
absl::Status IssuesStatus(const std::vector<CalibrationIssue>& issues);

}  // namespace weft
