#include "alignment/blank_vertices.h"

#include <algorithm>
#include <limits>
#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace weft {
namespace {

// Lengths around a vertex without a cell, mm.
struct Surroundings {
  double to_cell = 0;                                         // the longest edge to a vertex with a cell
  int cell = -1;                                              // that vertex
  double to_blank = std::numeric_limits<double>::infinity();  // the shortest edge to one without
  double opposite = 0;  // the longest side of its faces that it is not at
};

std::map<int, Surroundings> SurroundingsOf(std::span<const Face> faces, const Mapped& mapped) {
  std::map<int, Surroundings> out;
  for (const Face& face : faces) {
    for (size_t i = 0; i < 3; ++i) {
      if (mapped.NodeOf(face[i]).row >= 0) continue;
      const int sides[2] = {face[(i + 1) % 3], face[(i + 2) % 3]};
      Surroundings& around = out[face[i]];
      around.opposite =
          std::max(around.opposite, (mapped.PlaceOf(sides[0]) - mapped.PlaceOf(sides[1])).norm());
      for (const int side : sides) {
        const double length = (mapped.PlaceOf(face[i]) - mapped.PlaceOf(side)).norm();
        if (mapped.NodeOf(side).row < 0)
          around.to_blank = std::min(around.to_blank, length);
        else if (length > around.to_cell)
          around.to_cell = length, around.cell = side;
      }
    }
  }
  return out;
}

bool IsMisplaced(const Surroundings& around, double mm_per_cell) {
  constexpr double kFarCells = 12, kNearShare = 1.0 / 3;
  const double near = kNearShare * around.to_cell;
  return around.to_cell > kFarCells * mm_per_cell && (around.to_blank < near || around.opposite < near);
}

}  // namespace

absl::Status CheckBlankVertices(std::span<const Face> faces, const Mapped& mapped) {
  if (!(mapped.mm_per_cell > 0)) return absl::OkStatus();
  int misplaced = 0, first = -1;
  Surroundings of_first;
  for (const auto& [vertex, around] : SurroundingsOf(faces, mapped)) {
    if (!IsMisplaced(around, mapped.mm_per_cell)) continue;
    if (misplaced++ == 0) first = vertex, of_first = around;
  }
  if (misplaced == 0) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("vertex %d has no cell, and an edge of %.3g mm, %.2g cells, joins it to vertex %d, "
                      "which has one; so it "
                      "is of %d vertices without cells. Mesh and map are not in the same order.%s",
                      first, of_first.to_cell, of_first.to_cell / mapped.mm_per_cell, of_first.cell,
                      misplaced, kOrderRemedy));
}

}  // namespace weft
