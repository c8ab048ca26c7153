// What a decoded view says.
#pragma once

#include <compare>
#include <cstdint>

namespace weft {

// A board has two kinds of nodes: the centres of its cells, and the corners between cells.
enum class NodeKind : uint8_t { kCenter = 0, kCorner = 1 };

// A node of the board. Centre (r, c) is the middle of the cell in row r, column c. Corner (r, c) is the
// upper left corner of that cell, so it touches the cells (r-1, c-1), (r-1, c), (r, c-1) and (r, c).
// Corner rows run from 0 to rows, columns from 0 to cols.
struct BoardNode {
  int row = 0;
  int col = 0;
  NodeKind kind = NodeKind::kCenter;

  auto operator<=>(const BoardNode&) const = default;
};

// A board node seen at a pixel of one view.
struct Observation {
  double x_px = 0;
  double y_px = 0;
  BoardNode node;
  float sigma_px = 0;    // standard deviation per axis
  float confidence = 0;  // probability that the identity is right, 0 to 1
};

}  // namespace weft
