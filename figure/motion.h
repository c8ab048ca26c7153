// What a person does over time.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "figure/pose.h"

namespace weft {

// Poses at equal distances in time. Immutable use is safe from any number of threads.
struct Motion {
  double fps = 60;
  std::vector<FigurePose> poses;  // at 0, 1 / fps, ...

  double DurationS() const { return poses.empty() ? 0 : static_cast<double>(poses.size() - 1) / fps; }

  // Smooth in between (Catmull and Rom, of the quaternions' components); the first and last pose outside.
  FigurePose PoseAt(double time_s) const;

  // InvalidArgument names what is wrong: no poses, a rate beyond 1 to 1000, a value that is not finite, a
  // quaternion that is not of length 1 (to 1e-3).
  absl::Status Validate() const;
};

}  // namespace weft
