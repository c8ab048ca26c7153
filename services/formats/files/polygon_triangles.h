// Polygons of foreign meshes as triangles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace weft {

// Triangles of a polygon, by positions in `corners` and turned as it is: always two fewer than it has
// corners. Ears are cut off by their shortest diagonal, so that a quad is split along its shorter one, unless
// that lies outside of it. A polygon without an ear, folded or without area, is split all the same. Needs
// three corners. Deterministic.
std::vector<std::array<int, 3>> TrianglesOfPolygon(const std::vector<Eigen::Vector3d>& corners);

}  // namespace weft
