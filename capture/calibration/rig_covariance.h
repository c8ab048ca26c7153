// How well an adjusted rig is known.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "capture/calibration/calibration_bundle.h"

namespace weft {

// The information of the views and of the prior of the lenses (RadialPriorWeights). It is the Schur
// complement of the normal equations with the placements eliminated, [15 C + 4 B]^2: cameras (15 unknowns
// each, as in view_equations.h), then warps. `gauge` [.., 6] spans the unobservable motions, translations
// and rotations of the whole rig with its boards. `on_images` is the effect of each of these on the
// corners in the images, in terms of the unknowns.
struct RigInformation {
  Eigen::MatrixXd matrix;
  Eigen::MatrixXd gauge;
  Eigen::MatrixXd on_images;
};
RigInformation ReduceToRig(const CalibrationBundle& bundle, double huber_sigmas);

// Covariance of the same unknowns in the frame in which the corners, wherever cameras saw them, move least in
// the images; no camera or board counts as known. `variance_factor` scales it. Empty where the views do not
// fix the unknowns.
Eigen::MatrixXd FreeNetworkCovariance(const RigInformation& information, double variance_factor);

// Standard deviation in px of where a camera sees a known point, from the covariance of its unknowns [15,
// 15]: root mean square over both axes. NaN where it does not see the point.
double ProjectionSigmaPx(const CameraModel& camera, const Eigen::MatrixXd& covariance,
                         const Eigen::Vector3d& point_mm);

}  // namespace weft
