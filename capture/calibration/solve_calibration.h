// From the boards that cameras saw to a rig with sigmas.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/calibration/calibration_bundle.h"
#include "capture/calibration/shared_views.h"
#include "capture/calibration/target.h"
#include "capture/rig/rig.h"

namespace weft {

struct SolveOptions {
  int min_corners = 8;          // of a view; smaller ones say too little of the board's pose
  double huber_sigmas = 3;      // residuals beyond this count linearly
  double rejection_sigmas = 5;  // corners further off are left out
  double min_sigma_px = 0.01;   // no camera counts as better than this
  std::string world_frame;      // the board at this frame is the world; empty: the one that most cameras saw
  std::string world_board;      // which of the boards in that frame; empty: the one that most cameras saw
  bool world_on_floor = false;  // that board lies on the floor facing up: its normal is the world's -y
  bool scale_from_bar = false;  // metric scale from the scale bars instead of the boards' tags

  absl::Status Validate() const;
};

// What a camera's corners look like after the adjustment.
struct CameraFit {
  int views = 0;
  int corners = 0;
  int rejected_corners = 0;
  double sigma_px = 0;  // of a corner's coordinate, robust
  double rms_px = 0;    // of the corners that were kept
  // Of known points, over all places where boards were; NaN: it sees none of them.
  double projection_sigma_px = 0;
  Eigen::Matrix<double, 15, 15> covariance;  // of FreeNetworkCovariance
};

// A bar's length in the calibrated rig, over the frames in which both ends were seen by two cameras.
struct ScaleBarFit {
  int bar = 0;
  int frames = 0;
  double length_mm = 0;  // mean, by the boards' tag sizes
  double sigma_mm = 0;   // of the mean, from the spread over the frames
};

struct CalibrationSolution {
  CalibrationBundle bundle;  // corners that were kept
  std::vector<CameraFit> cameras;
  std::vector<SharedViewFate> shared_views;  // by frame
  std::vector<std::string> frames;           // their names
  std::vector<ScaleBarFit> bars;
  double scale = 1;  // that the scale bars put on the boards' sizes; 1 unless scale_from_bar
  double rms_px = 0;
  double variance_factor = 0;  // of the residuals over their sigmas; 1 for a model that fits
  Eigen::Vector3d stage_low_mm = Eigen::Vector3d::Zero(),
                  stage_high_mm = Eigen::Vector3d::Zero();  // where boards were
  int iterations = 0;
  bool converged = false;
};

// Lenses by GuessCamera or those of `initial`, poses by InitializePoses, adjustment in three rounds with
// every camera's own sigma and outliers rejected between them, world frame, covariance. All cameras must be
// linked (CountSharedViews). `on_progress` (may be empty) receives a stage and its share done, from any
// thread; calls never overlap. FailedPrecondition names the camera and the remedy. Parallel in the calling
// thread's TBB arena, the same bytes at any thread count.
absl::StatusOr<CalibrationSolution> SolveCalibration(
    const CalibrationTarget& target, const CalibrationViews& views, const std::optional<Rig>& initial,
    const SolveOptions& options, const std::function<void(const std::string&, double)>& on_progress = {});

}  // namespace weft
