// Surfaces whose geodesics have closed forms.
#pragma once

#include <cmath>
#include <functional>

#include "alignment/mesh.h"
#include "simulation/random.h"

namespace weft {

// Vertices (r, c) of a sheet, row by row, at place(x, y) with x = step * c, y = step * r. Interior vertices
// are moved by up to `shuffle` steps in the plane, so that no path runs along edges by luck.
inline TriangleMesh Sheet(int rows, int cols, double step_mm, double shuffle,
                          const std::function<Eigen::Vector3d(double, double)>& place) {
  TriangleMesh mesh;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) {
      const bool inside = r > 0 && r < rows - 1 && c > 0 && c < cols - 1;
      const auto noise = [&](uint64_t use) {
        return inside ? shuffle * (2 * UniformOf(use, static_cast<uint64_t>(r) * cols + c) - 1) : 0.0;
      };
      mesh.vertices_mm.push_back(place(step_mm * (c + noise(1)), step_mm * (r + noise(2))));
      if (r == 0 || c == 0) continue;
      const int v = r * cols + c;
      mesh.faces.push_back({v - cols - 1, v - 1, v});
      mesh.faces.push_back({v - cols - 1, v, v - cols});
    }
  }
  return mesh;
}

inline Eigen::Vector3d Flat(double x, double y) { return {x, y, 0}; }

// A vertical tube's wall of that radius; bends the sheet without stretching it.
inline std::function<Eigen::Vector3d(double, double)> Rolled(double radius_mm) {
  return [radius_mm](double x, double y) {
    return Eigen::Vector3d(radius_mm * std::sin(x / radius_mm), y, radius_mm * std::cos(x / radius_mm));
  };
}

}  // namespace weft
