// Lenses of other programs in Weft's model.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/camera_model.h"

namespace weft {

// Sets camera.distortion from OpenCV's coefficients k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y, the
// first 0, 4 to 8, 12 or 14 of them. InvalidArgument: another number of them, or terms that Weft's model
// lacks (thin prism, tilted sensor) and that are not zero.
absl::Status SetOpenCvDistortion(const std::vector<double>& coefficients, CameraModel* camera);

// Distance from the principal point, for a focal length of 1, at which a ray so far from the axis is seen.
using RadiusOfAngle = std::function<double(double angle_rad)>;

// OpenCV's fisheye model (Kannala-Brandt, "equidistant" of ROS and Kalibr): k1 to k4, fewer are zero.
RadiusOfAngle FisheyeRadius(std::vector<double> k);
// The model of one angle (Devernay and Faugeras 2001), "FOV" of COLMAP and "fov" of Kalibr.
RadiusOfAngle FovRadius(double omega_rad);

// Sets camera.distortion to the rational lens that is nearest to `radius` over the image of the camera, whose
// other numbers are set; focal lengths change where `radius` has another scale on the axis. Returns how far
// off it is at most, in px. InvalidArgument: more than 0.05 px, or a corner of the image more than 80 degrees
// off the axis. Least squares after Sanathanan and Koerner 1963.
absl::StatusOr<double> FitLens(const RadiusOfAngle& radius, CameraModel* camera);

}  // namespace weft
