// board.json with board.png beside it, or a plain board.png.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "pattern/board/board.h"

namespace weft {

// Reads a board.json with its image, or the folder of one. Also reads a plain image of the seven colours
// with one pixel per cell; its id is its content hash, cell_mm is 0. Errors name file and field: unknown
// fields, sizes or hash that do not fit the image, a colour that is none of the seven. Clashing codes are
// not looked for here (Board::FindClashes, BoardIndex::Build).
absl::StatusOr<Board> ReadBoard(const std::string& path);

// Panels of a board (pattern/board/panel_mask.h) from an image with one pixel per cell; errors name the file.
absl::StatusOr<std::vector<uint8_t>> ReadPanelMask(const std::string& path, int rows, int cols);

// Writes <folder>/board.png, <folder>/board.json and, for a board with panels, <folder>/panels.png; the
// folder is made where it is missing.
absl::Status WriteBoard(const std::string& folder, const Board& board, const std::string& provenance = "");

}  // namespace weft
