// How far two registrations of the same frame are apart, vertex by vertex.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace weft {

// Distances of equal surfaces, whose errors are independent and normal, are below this many standard
// deviations per axis with a probability of 99 % (chi distribution with three degrees of freedom).
inline constexpr double kDistanceSigmas99 = 3.3682;

struct MeshDifference {
  std::vector<double> distance_mm;  // [vertices]; NaN where a position is not finite
  // Distance by the standard deviation per axis of the difference, sqrt(sigma_a^2 + sigma_b^2), [vertices];
  // NaN where the distance or a sigma is not known. Empty without sigmas.
  std::vector<double> distance_sigmas;
};

// Positions in mm, [vertices] of both. `sigma_a_mm`, `sigma_b_mm`: per axis, [vertices], or empty: not known;
// a sigma of 0 is not known. Results of the same images share their noise, so their distances are less than
// the sigmas say, and a distance beyond them is no chance. Sizes must match.
MeshDifference DifferenceOf(const std::vector<Eigen::Vector3d>& a_mm,
                            const std::vector<Eigen::Vector3d>& b_mm, const std::vector<double>& sigma_a_mm,
                            const std::vector<double>& sigma_b_mm);

// Share of the known distances that are beyond kDistanceSigmas99; NaN where none is known.
double ShareBeyondSigmas(const std::vector<double>& distance_sigmas);

}  // namespace weft
