// A small garment: a standing tube whose cells are the vertices.
#pragma once

#include <cmath>
#include <numbers>

#include "alignment/template.h"

namespace weft {

inline Template TubeTemplate(int rows = 20, int cols = 60, double cell_mm = 6) {
  Template tube;
  tube.id = "tube";
  tube.board_hash = "fedcba9876543210";
  const double radius_mm = cols * cell_mm / (2 * std::numbers::pi);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c) {
      const double angle = 2 * std::numbers::pi * c / cols;
      tube.rest.vertices_mm.emplace_back(radius_mm * std::cos(angle), (r - 0.5 * rows) * cell_mm,
                                         radius_mm * std::sin(angle));
      tube.node_of_vertex.push_back({r, c, NodeKind::kCenter});
    }
  for (int r = 0; r + 1 < rows; ++r)
    for (int c = 0; c < cols; ++c) {
      const int a = r * cols + c, b = r * cols + (c + 1) % cols, d = a + cols, e = b + cols;
      tube.rest.faces.push_back({a, d, b});
      tube.rest.faces.push_back({b, d, e});
    }
  return tube;
}

}  // namespace weft
