// How well each vertex of a registered mesh is known.
#pragma once

#include <vector>

#include "alignment/align.h"

namespace weft {

// Standard deviation per axis in mm, [vertices]. Observed vertices: sigma^2 = share * noise^2 + fold^2 +
// excess^2, from the target's sigma (at least min_sigma_mm). share is the variance left by E_Dist's
// smoothing. The fold part is common to neighbours, so smoothing keeps it. excess is the displacement from
// the target beyond what noise explains. The sigma of other vertices grows with the distance from the
// observed ones. Vertices of components without any target get the size of the template, since nothing is
// known of them.
std::vector<float> VertexSigmas(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
                                const std::vector<Eigen::Vector3d>& position_mm, const AlignOptions& options);

// Of a wide triangular grid's Laplacian, about; the eigenvalues are nearly uniform between 0 and this.
inline constexpr double kMostEigenvalue = 12;

// Share of the variance of independent noise of weight 1 that is left on a wide triangular grid whose
// edges have the weight `coupling`. It is the mean of 1 / (1 + coupling * eigenvalue) over the eigenvalues
// of the graph's Laplacian.
double SmoothedVarianceShare(double coupling);

}  // namespace weft
