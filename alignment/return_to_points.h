// Measured vertices that the cloth's stiffness holds away from their points.
#pragma once

#include <vector>

#include "alignment/align.h"

namespace weft {

// E_Dist takes noise out of measured vertices, but bends creases flat that are narrower than the cloth's
// stiffness allows. Noise is told from bias by its size: a vertex keeps the share q^2 / (q^2 + m^2) of its
// way from its point, m that way in standard deviations of the point's noise, less what E_Dist takes out of
// noise alone, and q `options.noise_sigmas`. So flat cloth stays smooth, and no vertex is far from a point
// that is well known. Targets of unknown sigma leave their vertices where they are. Moves the vertices of
// `targets` in `position_mm`.
void ReturnToPoints(const std::vector<VertexTarget>& targets, const AlignOptions& options,
                    std::vector<Eigen::Vector3d>* position_mm);

}  // namespace weft
