// A printed cloth: mesh at rest, cell of each vertex, print. Sheet or tube.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/template.h"
#include "simulation/printed_mesh.h"

namespace weft {

enum class ClothShape { kSheet, kTube };

struct ClothOptions {
  ClothShape shape = ClothShape::kTube;
  int rows = 90;      // cells from top to bottom
  int cols = 144;     // cells from left to right; around, for a tube
  int first_row = 0;  // board cell of the upper left corner
  int first_col = 0;
  double cell_mm = 3;
  // A sheet's slits: each between the columns before and after, from the middle of row `slits_from` down.
  std::vector<int> slits;  // ascending, at least 2 cells apart and from the sides
  int slits_from = 0;

  // At least 4 x 4 cells (tube: 8 around), positive cell, first cell not negative, slits as said above.
  absl::Status Validate() const;
};

// World axes as in the rigs: x right, y down, z away from a viewer in front of the cloth. The cloth is
// centred on the origin with row 0 on top. The printed side faces -z for the sheet and outwards for the
// tube, whose column `cols / 2` faces -z. Vertices 0 .. rows * cols - 1 are the cell centres, row by row.
// Hem and seam vertices without a cell follow, on the outline of the printed area, then those of slits.
struct Cloth {
  ClothOptions options;
  TriangleMesh rest;                       // flat sheet or smooth tube
  std::vector<VertexNode> cell_of_vertex;  // [vertices]
  ClothPrint print;
  // The vertices as a grid of (rows + 2) lines; a tube's lines are closed (cols + 1 vertices, the seam
  // first), a sheet's have cols + 2.
  int grid_rows = 0, grid_cols = 0;
  bool closed = false;
  std::vector<int> vertex_of_grid;   // [grid_rows][grid_cols]
  std::vector<double> row_position;  // [grid_rows], in cells from the upper edge
  std::vector<double> col_position;  // [grid_cols], in cells from the left edge

  // The edges of each slit from its end down: left and right, both begin with the vertex at its end.
  std::vector<std::array<std::vector<int>, 2>> slit_edges;

  int vertex_at(int i, int j) const { return vertex_of_grid[static_cast<size_t>(i) * grid_cols + j]; }
};

absl::StatusOr<Cloth> BuildCloth(const ClothOptions& options);

// [faces], the corners of each face on the flat cloth, in mm.
std::vector<std::array<Eigen::Vector2d, 3>> FlatShape(const Cloth& cloth);

}  // namespace weft
