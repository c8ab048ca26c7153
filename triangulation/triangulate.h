// RANSAC triangulation of board nodes seen by several cameras (paper, section 5.2).
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "pattern/observation.h"
#include "triangulation/cloud.h"

namespace weft {

// The decoded nodes of one view.
struct ViewObservations {
  int camera = 0;  // index into Rig::cameras
  std::vector<Observation> observations;
};

// The search for the rays that meet in one point.
struct ConsensusOptions {
  double inlier_radius_mm = 1.0;  // distance of a ray from the point
  // Also asked of an inlier: pixel residual in units of the observation's sigma_px, with what the calibration
  // is known to leave (RefinementOptions::camera_sigma_px). Catches wrong rays that pass within the radius;
  // generous, since not all errors of a calibration are known.
  double max_residual_sigmas = 8;
  double min_residual_px = 0.5;  // residuals below this always pass the test by sigma
  int min_views = 3;             // inlier rays from distinct cameras
  double min_pair_angle_deg = 1;
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// The least-squares point of the inlier rays.
struct RefinementOptions {
  double huber_sigmas = 2.5;            // residuals beyond this count linearly
  double min_sigma_px = 0.02;           // no observation counts as more certain than this
  double calibration_sigma_px = 0.0;    // added to sigma_px in quadrature: what the rig's calibration leaves
  std::vector<double> camera_sigma_px;  // likewise, per camera of the rig; empty where it is not known
  double min_angle_deg = 2;             // between the outermost rays, else kPoorGeometry
  double max_sigma_mm = 1.0;            // points less certain are rejected (kPoorGeometry)

  absl::Status Validate() const;
};

// Nodes that exactly two cameras saw. The paper leaves them out; two rays that meet well are good evidence
// all the same, once their neighbours confirm it (CleanCloud).
struct TwoViewOptions {
  bool accept = true;
  double min_angle_deg = 8;        // between the two rays
  double max_residual_sigmas = 3;  // of their misclosure
  double max_sigma_mm = 0.3;

  absl::Status Validate() const;
};

struct TriangulationOptions {
  ConsensusOptions consensus;
  RefinementOptions refinement;
  TwoViewOptions two_view;

  absl::Status Validate() const;
};

// One point per node on which enough cameras agree, or two under TwoViewOptions. Every other observed node
// is in `rejected` with its reason and the number of cameras that saw it. A camera that sees a node more
// than once counts once, by the best observation. The covariance is the inverse of the normal matrix of
// the reprojection error, weighted by sigma_px, times a variance factor. The factor is at least 1 for the
// whole frame, and scaled for a node by the scatter of its residuals relative to the frame's. The
// uncertainty of the calibration is included; neighbours share it. InvalidArgument names camera and node
// of an observation that is not finite, off the range of boards (0 to 4096), or without sigma_px, and
// cameras that the rig lacks. Runs parallel loops in the calling thread's TBB arena; the same result at
// any thread count, and in any order of `views` as long as no camera occurs twice. Fastest where the
// observations of each view are in the order of kind, row, column, as decoding leaves them; others are
// copied and sorted.
absl::StatusOr<Cloud> Triangulate(const Rig& rig, const std::vector<ViewObservations>& views,
                                  const TriangulationOptions& options);

}  // namespace weft
