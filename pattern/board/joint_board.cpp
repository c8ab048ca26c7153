#include "pattern/board/joint_board.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Fractions that one fit of the print's profile serves.
constexpr double kSquareFractionTolerance = 0.01;
constexpr int kMostPanels = 255;

absl::Status CheckBoards(const std::vector<Board>& boards) {
  if (boards.size() < 2) return absl::InvalidArgumentError("give two boards or more to join");
  for (size_t i = 0; i < boards.size(); ++i) {
    const Board& board = boards[i];
    WEFT_RETURN_IF_ERROR(board.Validate());
    if (!board.parts.empty())
      return absl::InvalidArgumentError(absl::StrCat(
          "board ", board.id, " is a joint board itself; give the boards that it was joined of"));
    const double off = board.square_fraction - boards[0].square_fraction;
    if (std::abs(off) > kSquareFractionTolerance)
      return absl::InvalidArgumentError(
          absl::StrCat("square_fraction is ", boards[0].square_fraction, " on board ", boards[0].id, " and ",
                       board.square_fraction, " on board ", board.id, "; boards of one take need the same"));
    for (size_t k = 0; k < i; ++k)
      if (boards[k].ContentHash() == board.ContentHash())
        return absl::InvalidArgumentError(
            absl::StrCat("boards ", boards[k].id, " and ", board.id,
                         " are the same print; garments of one take need boards of their own"));
  }
  return absl::OkStatus();
}

// A colour that neither the cell above nor the one to the left has.
CellColor ColorBeside(const Board& board, int row, int col) {
  for (int color = 0; color < kCellColors; ++color) {
    const CellColor candidate = static_cast<CellColor>(color);
    if (row > 0 && board.at(row - 1, col) == candidate) continue;
    if (col > 0 && board.at(row, col - 1) == candidate) continue;
    return candidate;
  }
  return CellColor::kRed;
}

}  // namespace

absl::StatusOr<Board> JoinBoards(const std::vector<Board>& boards) {
  WEFT_RETURN_IF_ERROR(CheckBoards(boards));
  Board joint;
  joint.square_fraction = boards[0].square_fraction;
  joint.cell_mm = boards[0].cell_mm;
  for (const Board& board : boards) {
    if (joint.rows > 0) joint.rows += kRowsBetweenParts;
    joint.parts.push_back(
        {board.id, joint.rows, board.rows, board.cols, board.cell_mm, !board.panels.empty()});
    joint.rows += board.rows;
    joint.cols = std::max(joint.cols, board.cols);
    if (board.cell_mm != joint.cell_mm) joint.cell_mm = 0;  // no pitch holds for all
  }
  joint.cells.resize(static_cast<size_t>(joint.rows) * joint.cols);
  joint.panels.assign(joint.cells.size(), 0);
  int labels = 0;
  size_t part = 0;
  for (int row = 0; row < joint.rows; ++row) {
    if (part + 1 < boards.size() && row == joint.parts[part + 1].first_row) {
      labels += boards[part].panels.empty()
                    ? 1
                    : *std::max_element(boards[part].panels.begin(), boards[part].panels.end());
      ++part;
    }
    const Board& board = boards[part];
    const int own_row = row - joint.parts[part].first_row;
    for (int col = 0; col < joint.cols; ++col) {
      const size_t cell = static_cast<size_t>(row) * joint.cols + col;
      joint.cells[cell] =
          board.Contains(own_row, col) ? board.at(own_row, col) : ColorBeside(joint, row, col);
      if (!board.Contains(own_row, col)) continue;
      const int label =
          board.panels.empty() ? 1 : board.panels[static_cast<size_t>(own_row) * board.cols + col];
      if (label == 0) continue;
      if (labels + label > kMostPanels)
        return absl::InvalidArgumentError(
            absl::StrCat("the boards have more than ", kMostPanels, " panels in all"));
      joint.panels[cell] = static_cast<uint8_t>(labels + label);
    }
  }
  joint.id = joint.ContentHash();
  WEFT_RETURN_IF_ERROR(joint.Validate());
  return joint;
}

Board PartOfBoard(const Board& joint, int part) {
  const BoardPart& place = joint.parts[part];
  Board board;
  board.id = place.id;
  board.rows = place.rows;
  board.cols = place.cols;
  board.cell_mm = place.cell_mm;
  board.square_fraction = joint.square_fraction;
  int first_label = 0;  // the greatest of the parts before
  for (int row = 0; row < place.first_row; ++row)
    for (int col = 0; col < joint.cols; ++col)
      first_label = std::max<int>(first_label, joint.panels[static_cast<size_t>(row) * joint.cols + col]);
  for (int row = place.first_row; row < place.first_row + place.rows; ++row) {
    for (int col = 0; col < place.cols; ++col) {
      board.cells.push_back(joint.at(row, col));
      if (!place.has_panels) continue;
      const int label = joint.panels[static_cast<size_t>(row) * joint.cols + col];
      board.panels.push_back(static_cast<uint8_t>(label == 0 ? 0 : label - first_label));
    }
  }
  return board;
}

}  // namespace weft
