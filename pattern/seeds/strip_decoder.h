// Where narrow strips of lattice lie on the board.
#pragma once

#include <utility>
#include <vector>

#include "pattern/board/board_index.h"
#include "pattern/fit/cell.h"
#include "pattern/seeds/patch_decoder.h"

namespace weft {

// Pieces of a patch that may be two cells wide, or whose rows are shifted against each other, as in
// lattices of foreshortened cells. They are windows of 2x3 cells that read one pose, or windows of six
// cells along one line, whose pose holds on that line alone. A single such window occurs many times on a
// large board. At least two have to agree, and the result needs more evidence than a piece of 3x3 windows.
// Ordered by the number of windows; a cell is in one piece at most. Its centers are the cells of two
// windows or more.
std::vector<DecodedPiece> DecodeStrip(const MeasuredPatch& patch, const BoardIndex& board);

// Cells of one patch, which lie at these points: those with neighbours in their row and in their column, and
// with edges as these show them. Points that show the board in a mirror are left out.
std::vector<PlacedCell> PlaceCells(const std::vector<std::pair<BoardCell, Keypoint>>& cells);

}  // namespace weft
