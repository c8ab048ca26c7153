// How far two sets of points are apart, whichever point belongs to which.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace weft {

// Distance of each point to the nearest of the others in mm, [points]; `others` is not empty.
std::vector<double> NearestDistances(const std::vector<Eigen::Vector3d>& points_mm,
                                     const std::vector<Eigen::Vector3d>& others_mm);

// Mean of NearestDistances one way and the other, and of both ways. It has a floor of about half the distance
// between neighbours.
double ChamferMm(const std::vector<Eigen::Vector3d>& a_mm, const std::vector<Eigen::Vector3d>& b_mm);

}  // namespace weft
