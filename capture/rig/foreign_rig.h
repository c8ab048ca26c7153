// Rigs in the formats of other programs.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "capture/rig/rig.h"

namespace weft {

struct ForeignRig {
  Rig rig;
  std::vector<std::string> remarks;  // what was not used, or may be meant otherwise; each names its camera

  // Rig::Validate, and ids that files and folders can have: plain text without a slash.
  absl::Status Validate() const;
};

// How another program's poses are to be taken.
struct PoseConvention {
  double mm_per_unit = 1;
  bool world_from_camera = false;  // rotation and translation are those of the camera in the world
};

// Changes the poses of `rig`, read as camera_from_world in mm, to what they mean.
void ApplyConvention(const PoseConvention& convention, Rig* rig);

// Whether the cameras make a studio. InvalidArgument names what seems to be meant instead:
// - centres within 30 mm of each other: lengths in another unit (`judge_unit`);
// - axes that meet three times as closely, in front of the cameras, as world_from_camera or with OpenGL's
//   axes (`judge_poses`);
// - a principal point outside the image: the calibration of another size of image.
// What may be right as well becomes a remark: cameras that see less than 250 mm where they look at, or more
// than 50 m (`judge_unit`), and principal points far from the middle.
struct RigJudgement {
  bool judge_unit = true, judge_poses = true;
};
absl::Status JudgeRig(const RigJudgement& judgement, ForeignRig* rig);

}  // namespace weft
