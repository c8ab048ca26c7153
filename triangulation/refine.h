// Least-squares point of the rays of one node.
#pragma once

#include <optional>
#include <span>

#include "triangulation/sight.h"
#include "triangulation/triangulate.h"

namespace weft {

// Steps shorter than this change nothing that anyone could see.
inline constexpr double kRefinedMm = 1e-6;

struct RefinedPoint {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();  // for a variance factor of 1
  double chi_square = 0;  // sum of the squared residuals in units of their sigma
  int iterations = 0;
};

// Sum over the chosen sights of the Huber loss of the residual in units of its sigma; infinite where the
// point is behind a camera.
double ReprojectionCost(const Eigen::Vector3d& point_mm, std::span<const Sight> sights,
                        std::span<const int> chosen, const RefinementOptions& options);

// Minimises ReprojectionCost by Gauss-Newton with reweighting, from `start_mm`, which takes many steps where
// many rays are beyond Huber's bound. Empty where the rays do not fix a point (normal matrix singular) or the
// point leaves the front of a camera.
std::optional<RefinedPoint> RefinePoint(const Eigen::Vector3d& start_mm, std::span<const Sight> sights,
                                        std::span<const int> chosen, const RefinementOptions& options);

}  // namespace weft
