// Several boards as one, for takes that show garments of more than one print.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "pattern/board/board.h"

namespace weft {

// Rows between the parts of a joint board. No garment has cells there.
inline constexpr int kRowsBetweenParts = 4;

// The boards below each other, in their order; `parts` of the result says where. Panels keep their shape and
// get new labels, a board without panels is one panel. Decoding the result finds the cells of all boards in
// one pass. Clashes between the boards are not looked for here (Board::FindClashes, BoardIndex::Build).
// InvalidArgument: fewer than two boards, the same one twice, a joint board among them, square fractions
// that differ, more than 255 panels, more than 4096 rows in all.
absl::StatusOr<Board> JoinBoards(const std::vector<Board>& boards);

// One of the boards of a joint one, as it was before. The index must be valid.
Board PartOfBoard(const Board& joint, int part);

}  // namespace weft
