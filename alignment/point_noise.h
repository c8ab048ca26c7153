// What a point's noise is, and how far E_Dist holds a vertex off its point because of it.
#pragma once

#include "alignment/align.h"

namespace weft {

// Inverse of the covariance of the target's noise, 1 / mm^2. What folds cause is no noise. The target's sigma
// or covariance must be known.
Eigen::Matrix3d NoiseInformation(const VertexTarget& target, const DetectionOptions& options);

bool HasKnownNoise(const VertexTarget& target);

// Variance of the way from the point to the vertex where cloth is flat, as a share of the noise's, 0 to 1.
double OffsetVarianceShare(const VertexTarget& target, const AlignOptions& options);

}  // namespace weft
