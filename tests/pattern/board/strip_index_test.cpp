#include "pattern/board/strip_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "pattern/board/board_index.h"

namespace weft {
namespace {

using Shape = StripIndex::Shape;
using Places = std::multiset<BoardPose>;

Places PlacesOf(const StripIndex& index, const Board& board, const std::array<int, 6>& colors) {
  Places places;
  for (const PackedPose& pose : index.Find(StripIndex::Code(colors)))
    places.insert({pose.cell() / board.cols, pose.cell() % board.cols, pose.quarter_turns()});
  return places;
}

// What a lattice under the pose shows in its first six cells; nothing where one is off the board.
std::optional<std::array<int, 6>> ColorsAt(const Board& board, const BoardPose& pose, int width) {
  std::array<int, 6> colors;
  for (int k = 0; k < 6; ++k) {
    const BoardCell at = pose.ToBoard(k / width, k % width);
    if (!board.Contains(at.row, at.col)) return std::nullopt;
    colors[k] = static_cast<int>(board.at(at.row, at.col));
  }
  return colors;
}

TEST(StripIndex, FindsAllPlacesInAllOrientations) {
  const Board board = *GenerateBoard(23, 31, 3, 4);
  for (const auto& [shape, width] : {std::pair{Shape::k2x3, 3}, {Shape::k1x6, 6}}) {
    const StripIndex index(board, shape);
    std::map<std::array<int, 6>, Places> there;
    for (int row = 0; row < board.rows; ++row) {
      for (int col = 0; col < board.cols; ++col) {
        for (int turns = 0; turns < 4; ++turns) {
          const BoardPose pose{row, col, turns};
          if (const auto colors = ColorsAt(board, pose, width)) there[*colors].insert(pose);
        }
      }
    }
    for (const auto& [colors, places] : there) EXPECT_EQ(PlacesOf(index, board, colors), places);
    size_t all = 0;
    for (uint32_t code = 0; code < 117649; ++code) all += index.Find(code).size();
    EXPECT_EQ(all, static_cast<size_t>(width == 3 ? 2 * (22 * 29 + 21 * 30) : 2 * (23 * 26 + 18 * 31)));
  }
}

TEST(StripIndex, WindowsLieOnOnePanel) {
  Board board = *GenerateBoard(12, 20, 3, 4);
  board.panels.assign(board.cells.size(), 1);
  for (int row = 0; row < 12; ++row) {
    for (int col = 8; col < 20; ++col) board.panels[static_cast<size_t>(row) * 20 + col] = col < 11 ? 0 : 2;
  }
  const StripIndex index(board, Shape::k2x3);
  size_t all = 0;
  for (uint32_t code = 0; code < 117649; ++code) {
    for (const PackedPose& packed : index.Find(code)) {
      const BoardPose pose{packed.cell() / 20, packed.cell() % 20, packed.quarter_turns()};
      const BoardCell first = pose.ToBoard(0, 0), last = pose.ToBoard(1, 2);
      const int left = std::min(first.col, last.col), right = std::max(first.col, last.col);
      EXPECT_TRUE(right < 8 || left >= 11) << left << " to " << right;
      ++all;
    }
  }
  EXPECT_EQ(all, static_cast<size_t>(2 * (11 * 6 + 10 * 7) + 2 * (11 * 7 + 10 * 8)));
}

}  // namespace
}  // namespace weft
