// Better triangles between the same vertices.
#pragma once

#include <vector>

#include "alignment/mesh.h"

namespace weft {

// Flips edges between two faces where the surface folds over (by more than 90 degrees) or a face is a sliver
// (an angle below 15 degrees), and the flip mends that: Lawson 1977, with angles between faces. Vertices,
// openings and seams stay, and so do edges that would occur twice. Vertices at the same position count as
// one, so faces on both sides of a seam are neighbours; the seam itself is never flipped. `places`: of each
// vertex on the print, or empty; no face is turned over there that was not. Faces name vertices that exist.
void FlipBadEdges(const std::vector<Eigen::Vector3d>& positions, const std::vector<Eigen::Vector2f>& places,
                  std::vector<Face>& faces);

}  // namespace weft
