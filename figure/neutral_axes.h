// How foreign joints stand when the person stands at rest as ours does.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>

#include "figure/foreign_summary.h"
#include "figure/retarget.h"

namespace weft {

// The axis of the world, with its sign, that is nearest.
Eigen::Vector3d NearestWorldAxis(const Eigen::Vector3d& v);

// The axes of a rest pose that stands upright along the axes of its world with the legs side by side: rows
// are our x, y, z in it. Nothing of any other rest pose.
std::optional<Eigen::Matrix3d> StandingAxes(const ForeignMotion& motion, const JointMatch& match);

// Of each joint of ours that the file has: what turns our axes at rest into those of the foreign joint. The
// rest pose gives it where `standing`, but for limbs that bend more than 45 degrees beside where it says;
// else bones, hips, shoulders, and the planes in which limbs bend. What none of them tells is chosen so that
// a joint is turned least against its parent, in the mean of the poses.
std::array<Eigen::Quaterniond, kJoints> NeutralAxes(const JointMatch& match, const ForeignSummary& summary,
                                                    const std::optional<Eigen::Matrix3d>& standing);

}  // namespace weft
