// A frame to align: a rolled and wrinkled sheet of n x n vertices of which a quarter is hidden in round
// patches.
#pragma once

#include <vector>

#include "tests/alignment/cloth_sheets.h"

namespace weft::testing {

struct MeasuredSheet {
  Template garment;
  std::vector<Eigen::Vector3d> truth;
  std::vector<VertexTarget> targets;
};

// Patches of 40 cells' pitch and 11.3 cells' radius: a quarter of the surface.
inline bool InHiddenPatch(int v, int cols) {
  const double row = v / cols % 40 - 20, col = v % cols % 40 - 20;
  return std::hypot(row, col) < 11.3;
}

// Wrinkles 1.5 mm deep and 30 mm long on a cylinder. They stretch the cloth by about 5 % at the most.
inline Eigen::Vector3d Wrinkled(const Eigen::Vector3d& p) {
  const double radius_mm = 150 + 1.5 * std::sin(p.x() / 4.8) * std::sin(p.y() / 11);
  return {radius_mm * std::sin(p.x() / 150), p.y(), -radius_mm * std::cos(p.x() / 150)};
}

inline MeasuredSheet WrinkledSheet(int n) {
  MeasuredSheet sheet;
  sheet.garment = SheetTemplate(FlatSheet(n, n));
  sheet.truth = Mapped(sheet.garment.rest.vertices_mm, Wrinkled);
  sheet.targets = Measure(sheet.truth, 0.3, 1, [&](int v) { return !InHiddenPatch(v, n); });
  return sheet;
}

}  // namespace weft::testing
