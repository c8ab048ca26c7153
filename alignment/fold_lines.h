// Creases that the cloth's stiffness has flattened.
#pragma once

#include <vector>

#include "alignment/align.h"

namespace weft {

// E_Dist holds vertices along a crease off their points, all in the same way; noise is another at each. Of
// the straight lines of five vertices through each measured vertex (along edges, at rest), the one whose mean
// offset from the points is the most significant is taken. The vertex moves back by that mean, shrunk by what
// noise alone would make of it (James and Stein 1961, Estimation with Quadratic Loss, positive part). So
// creases keep their shape, and flat cloth stays smooth. Vertices with targets of unknown sigma neither move
// nor count, and with `options.noise_sigmas` of 0 nothing moves. Moves the vertices of `targets` in
// `position_mm`.
void RestoreFolds(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
                  const AlignOptions& options, std::vector<Eigen::Vector3d>* position_mm);

}  // namespace weft
