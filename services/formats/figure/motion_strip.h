// A motion as people look at it.
#pragma once

#include <array>
#include <string>

#include "figure/motion.h"

namespace weft {

struct JointUse {
  Joint joint = Joint::kPelvis;
  double farthest_deg = 0;   // from its place at rest
  double fastest_deg_s = 0;  // between neighbouring poses
};
std::array<JointUse, kJoints> JointUses(const Motion& motion);

// An SVG of twelve moments, equally spaced, with a time scale: from the front above, from the person's left
// below.
std::string MotionStripSvg(const Motion& motion);

}  // namespace weft
