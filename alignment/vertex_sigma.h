// How well each vertex of a registered mesh is known.
#pragma once

#include <vector>

#include "alignment/align.h"

namespace weft {

// Standard deviation per axis in mm, [vertices]. Measured vertices: their target's, at least min_sigma_mm,
// lowered by what E_Dist lets them borrow from their neighbours, to whom the part of folds is common; where
// E_Dist pulled the vertex further from its target than that explains, one of both is wrong, and the excess
// is added in quadrature. Others grow with the distance from the measured ones. Vertices of components
// without any target get the size of the template, since nothing is known of them.
std::vector<float> VertexSigmas(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
                                const std::vector<Eigen::Vector3d>& position_mm, const AlignOptions& options);

// Of the variance that E_Dist takes away: a pull that noise alone hardly ever causes.
inline constexpr double kExpectedPull = 3;

// Share of the variance of independent noise of weight 1 that is left on a wide triangular grid whose edges
// have the weight `coupling`: the mean of 1 / (1 + coupling * eigenvalue) over the eigenvalues of the graph's
// Laplacian, which spread from 0 to about 12 (nearly evenly, as on any surface).
double SmoothedVarianceShare(double coupling);

}  // namespace weft
