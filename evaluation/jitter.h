// Jitter of a registered sequence.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace weft {

// Length of the second difference of each vertex over three consecutive frames, |a - 2 b + c| in mm,
// [vertices]. The cloth's own acceleration is part of it. The three vectors have the same length.
std::vector<double> SecondDifferences(const std::vector<Eigen::Vector3d>& before_mm,
                                      const std::vector<Eigen::Vector3d>& now_mm,
                                      const std::vector<Eigen::Vector3d>& after_mm);

// Length of the change of each vertex's error from one frame to the next in mm, [vertices]: the motion of the
// registered mesh less that of the truth. The four vectors have the same length.
std::vector<double> ErrorChanges(const std::vector<Eigen::Vector3d>& now_mm,
                                 const std::vector<Eigen::Vector3d>& true_now_mm,
                                 const std::vector<Eigen::Vector3d>& after_mm,
                                 const std::vector<Eigen::Vector3d>& true_after_mm);

}  // namespace weft
