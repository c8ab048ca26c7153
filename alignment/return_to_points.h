// Measured vertices that the cloth's stiffness holds away from their points.
#pragma once

#include <vector>

#include "alignment/align.h"

namespace weft {

// E_Dist removes noise from observed vertices, but flattens creases that are narrower than the cloth's
// stiffness allows. Noise is distinguished from bias by its size. A vertex keeps the share q^2 / (q^2 +
// m^2) of its offset from its point. m is that offset in standard deviations of the point's noise, less
// what E_Dist removes of noise alone; q is `options.noise_sigmas`. So flat cloth stays smooth, and no
// vertex is far from a precise point. Vertices with targets of unknown sigma are not moved. Moves the
// vertices of `targets` in `position_mm`.
void ReturnToPoints(const std::vector<VertexTarget>& targets, const AlignOptions& options,
                    std::vector<Eigen::Vector3d>* position_mm);

}  // namespace weft
