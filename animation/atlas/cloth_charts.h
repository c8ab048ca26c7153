// How a garment's cloth lies flat: the charts of its texture, or its panels on the board. What an atlas is
// laid out by.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/garment_mesh.h"
#include "alignment/template.h"

namespace weft {

// Places are columns and rows in cells, rows downwards; those of one chart compare with each other alone.
struct ClothCharts {
  int charts = 0;
  std::vector<int> of_vertex;  // [vertices], -1: in none
  std::vector<Eigen::Vector2d>
      vertex_cells;  // [vertices]; of a vertex of several charts its place in that one
  // Between vertices, and where a vertex lies in a second place beyond a seam. Empty where each cell has a
  // vertex of its own, as on a board.
  std::vector<int> of_face;                                  // [faces], -1: in none
  std::vector<std::array<Eigen::Vector2d, 3>> corner_cells;  // [faces]
  double cell_mm = 0;                                        // 0: as the board's
  // Edges whose two faces have other texture coordinates, and their length at rest.
  int seam_edges = 0;
  double seam_mm = 0;
};

// The charts of a mesh without a board: faces that hang together across edges at whose ends they agree in
// their texture coordinates. A cell is as wide as the median edge, and each chart is scaled to the size of
// its cloth, so that neither the packing of the texture nor its aspect matters. InvalidArgument: the mesh has
// no texture coordinates, a chart has no area, or is stretched beyond use.
absl::StatusOr<ClothCharts> ChartsOfTexture(const GarmentMesh& garment);

// The panels of a template: nodes that neighbour each other on the board and in the mesh.
ClothCharts ChartsOnBoard(const Template& garment);

}  // namespace weft
