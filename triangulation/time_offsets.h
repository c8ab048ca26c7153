// By how much the clocks of cameras differ, from the motion of decoded nodes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "pattern/observation.h"

namespace weft {

// What one camera saw at a moment of its own clock.
struct TimedObservations {
  double time_s = 0;
  std::vector<Observation> observations;
};

// `camera`: position in the rig. Moments rise; those that follow one another by less than 1.5 periods count
// as consecutive.
struct CameraFilm {
  int camera = 0;
  double period_s = 0;
  std::vector<TimedObservations> moments;
};

struct TimeOffsetOptions {
  double max_offset_s = 0.75;      // between any two cameras
  int min_samples = 200;           // of a pair of cameras, at every offset that is tried
  int max_samples = 3000;          // of a pair; more are thinned out evenly
  double distinct = 1.3;           // mean cost of any other minimum over that of the best one
  double max_sigma_periods = 0.2;  // a pair that tells less is left out

  absl::Status Validate() const;
};

struct TimeOffset {
  // Added to the camera's times; then they compare. Missing: nothing ties the camera to the first group.
  std::optional<double> offset_s;
  double sigma_s = 0;
  int pairs = 0;          // of cameras that tell of it
  double residual_s = 0;  // of the pairs' offsets to the solution, root of the mean square
};

// The offsets' mean is zero: only differences can be seen. A node that moves lies on the epipolar line of its
// image in another camera only if both images are of one moment (Albl et al., On the Two-View Geometry of
// Unsynchronized Cameras, CVPR 2017, who take image motion as linear). Here positions are interpolated
// between frames, the offset of each pair is searched over the whole range and refined by Gauss-Newton with
// Cauchy weights; all pairs are then solved together. Sigmas are those of errors that are alike for all
// moments of a node, scaled up where pairs contradict each other. InvalidArgument: options, a film of a
// camera that the rig lacks, fewer than two films. FailedPrecondition: no pair tells, with the reason.
absl::StatusOr<std::vector<TimeOffset>> FindTimeOffsets(const Rig& rig, const std::vector<CameraFilm>& films,
                                                        const TimeOffsetOptions& options);

}  // namespace weft
