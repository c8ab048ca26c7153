// How long the edges of a template's mesh are against the print.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh.h"
#include "alignment/template.h"
#include "base/length_unit.h"
#include "pattern/board/board.h"

namespace weft {

// Relative deviations from the print. Built garments deviate by 0.1 % in the median and 0.2 % along an axis
// (tests/alignment/template_build/template_check_test.cpp); worn cloth stretches by some per cent.
inline constexpr double kScaleSaid = 0.01, kScaleRefused = 0.05;

struct PrintScale {
  double median = 0;  // of edges between nodes: length over that on the print; 0 where nothing tells it
  // The direction of the mesh along which it is furthest from the print, and its scale there: 1 where cloth
  // is only bent. They tell stretched axes, which a median hides.
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  double along_axis = 0;  // 0 where nothing tells it

  // The one that is further from 1; 0 where nothing tells it.
  double Worst() const;
};

// Cells of a board are `cell_mm` apart; 0 where that is unknown, as of a plain board.png. `row` tells the
// part of a joint board.
double CellMmAt(const Board& board, int row);

// An edge between two nodes: in mm of the mesh, and in cells on the board.
struct NodeEdge {
  Eigen::Vector3d mesh_mm;
  Eigen::Vector2d board_cells;

  double LengthPerCell() const { return mesh_mm.norm() / board_cells.norm(); }
};
// Those of some 4,000 faces at most, evenly spread.
std::vector<NodeEdge> SampleNodeEdges(const std::vector<Eigen::Vector3d>& vertices_mm,
                                      std::span<const Face> faces, const std::vector<VertexNode>& nodes);

// Whether an edge joins nodes that are apart on the board, by more than two cells and twice its length.
// `mm_per_cell`: the median of the mesh's edges, so that meshes of any size and fineness are judged alike.
bool IsApart(const NodeEdge& edge, double mm_per_cell);
double MedianLengthPerCell(const std::vector<NodeEdge>& edges);  // 0 of none

// Of edges between nodes that are not apart. `cell_mm` 0 or less: unknown.
PrintScale MeasurePrintScale(const std::vector<NodeEdge>& edges, double cell_mm);

// The unit, other than mm, whose numbers are such a share of those in mm; within a tenth.
std::optional<UnitOfLength> UnitOfScale(double scale);

// "edges are 1.100 times as long as the print", or along an axis. Empty up to kScaleSaid, and where the scale
// is unknown.
std::string PrintScaleWords(const PrintScale& scale);
// InvalidArgument beyond kScaleRefused, with the unit where one explains it.
absl::Status CheckPrintScale(const PrintScale& scale);

}  // namespace weft
