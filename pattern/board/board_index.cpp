#include "pattern/board/board_index.h"

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {

namespace {

absl::Status ClashError(const Board& board) {
  const CodeClash c = board.FindClashes(1).front();
  return absl::InvalidArgumentError(
      absl::StrCat("board ", board.id, ": the 3x3 windows at row ", c.row_a, " col ", c.col_a, " and row ",
                   c.row_b, " col ", c.col_b, " read the same after ", c.quarter_turns,
                   " quarter turns; decoding needs a board with unique windows"));
}

}  // namespace

absl::StatusOr<BoardIndex> BoardIndex::Build(const Board& board) {
  WEFT_RETURN_IF_ERROR(board.Validate());
  BoardIndex index;
  index.board_ = board;
  const size_t codes = static_cast<size_t>(board.rows - 2) * (board.cols - 2) * 4;
  int bits = 4;
  while ((size_t{1} << bits) < 2 * codes) ++bits;
  index.shift_ = 32 - bits;
  index.slots_.resize(size_t{1} << bits);
  for (int row = 0; row + 3 <= board.rows; ++row) {
    for (int col = 0; col + 3 <= board.cols; ++col) {
      if (!board.HasWindow(row, col)) continue;
      const auto turned = RotatedCodes(BoardWindow(board, row, col));
      const uint32_t window = static_cast<uint32_t>(row * board.cols + col) * 4;
      for (uint32_t turn = 0; turn < 4; ++turn) {
        if (!index.Insert(turned[turn], window + turn)) return ClashError(board);
      }
    }
  }
  for (const auto shape : {StripIndex::Shape::k2x3, StripIndex::Shape::k1x6})
    index.strips_[static_cast<int>(shape)] = std::make_shared<const StripIndex>(board, shape);
  return index;
}

bool BoardIndex::Insert(uint32_t code, uint32_t window) {
  size_t slot = SlotOf(code);
  for (; slots_[slot].code != kWindowCodes; slot = (slot + 1) & (slots_.size() - 1)) {
    if (slots_[slot].code == code) return false;
  }
  slots_[slot] = {code, window};
  return true;
}

std::optional<BoardPose> BoardIndex::FindCode(uint32_t code) const {
  for (size_t slot = SlotOf(code); slots_[slot].code != kWindowCodes;
       slot = (slot + 1) & (slots_.size() - 1)) {
    if (slots_[slot].code != code) continue;
    const uint32_t window = slots_[slot].window;
    BoardPose pose;
    pose.quarter_turns = static_cast<int>(window & 3);
    pose.row = static_cast<int>(window / 4) / board_.cols;
    pose.col = static_cast<int>(window / 4) % board_.cols;
    // The window was turned about its middle, the pose turns about the lattice's first cell.
    if (pose.quarter_turns == 1 || pose.quarter_turns == 2) pose.col += 2;
    if (pose.quarter_turns == 2 || pose.quarter_turns == 3) pose.row += 2;
    return pose;
  }
  return std::nullopt;
}

}  // namespace weft
