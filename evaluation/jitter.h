// Trembling of a registered sequence.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace weft {

// Length of the second difference of each vertex over three consecutive frames, |a - 2 b + c| in mm,
// [vertices]. The cloth's own acceleration is part of it. The three vectors have the same length.
std::vector<double> SecondDifferences(const std::vector<Eigen::Vector3d>& before_mm,
                                      const std::vector<Eigen::Vector3d>& now_mm,
                                      const std::vector<Eigen::Vector3d>& after_mm);

}  // namespace weft
