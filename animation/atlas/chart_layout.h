// The charts of a garment's cloth, packed into one image: which texel each vertex has.
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "alignment/garment_mesh.h"
#include "animation/atlas/cloth_charts.h"

namespace weft {

// A vertex where a chart has it; those on seams have several. Columns and rows, centres of texels have whole
// coordinates.
struct ChartSeat {
  int vertex = 0, panel = 0;
  Eigen::Vector2d cells = Eigen::Vector2d::Zero();  // in the chart, as ClothCharts has it
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  // in the image
  Eigen::Vector2i texel = Eigen::Vector2i::Zero();
  bool is_in_fill = false;  // its texel is a ChartFill
};

// A texel whose middle lies in a face, and in which at most one vertex lies: what the face has there.
struct ChartFill {
  int panel = 0;
  Eigen::Vector2i texel = Eigen::Vector2i::Zero();
  std::array<std::pair<int, float>, 3> weights;  // of vertices
};

struct ChartLayout {
  std::vector<ChartSeat> seats;  // those of ClothCharts::of_vertex first, by vertex
  std::vector<ChartFill> fills;
  int cols = 0, rows = 0;  // of the image, with the gutter
};

// Texels are `texel_cells` wide, and `gutter` texels around each panel stay empty.
ChartLayout LayOutCharts(const GarmentMesh& garment, const ClothCharts& charts, int texel_cells, int gutter);

}  // namespace weft
