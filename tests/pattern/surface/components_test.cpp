#include "pattern/surface/components.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "tests/pattern/board/test_boards.h"

namespace weft {
namespace {

using Position = std::pair<int, int>;  // row, column

// What is left of a board's cells when small components are dropped.
std::set<Position> Left(const Board& board, const std::set<Position>& cells, int least_of_few) {
  BoardState state(board, 100, 100);
  for (const auto& [row, col] : cells) state.Add({row, col, {}, 0, 0, 1});
  DropSmallComponents(least_of_few, cells.size(), &state);
  std::set<Position> left;
  for (const ViewCell& cell : state.cells()) left.insert({cell.row, cell.col});
  EXPECT_EQ(left.size(), state.cells().size());
  return left;
}

// Cells of components of `least` or more, by labels that neighbours take over until none changes.
std::set<Position> LargeByLabels(const std::set<Position>& cells, size_t least) {
  std::map<Position, int> labels;
  for (const Position& cell : cells) labels[cell] = static_cast<int>(labels.size());
  for (bool changed = true; changed;) {
    changed = false;
    for (auto& [cell, label] : labels) {
      for (const Position& next : {Position{cell.first + 1, cell.second},
                                   {cell.first - 1, cell.second},
                                   {cell.first, cell.second + 1},
                                   {cell.first, cell.second - 1}}) {
        const auto other = labels.find(next);
        if (other == labels.end() || other->second >= label) continue;
        label = other->second;
        changed = true;
      }
    }
  }
  std::map<int, size_t> sizes;
  for (const auto& [cell, label] : labels) ++sizes[label];
  std::set<Position> large;
  for (const auto& [cell, label] : labels) {
    if (sizes[label] >= least) large.insert(cell);
  }
  return large;
}

TEST(SmallComponents, AreDroppedAsLabelsSay) {
  const Board board = PlainBoard(30, 25);
  std::mt19937 random(2);
  for (const int share_percent : {30, 45, 60}) {
    std::set<Position> cells;
    for (int row = 0; row < board.rows; ++row) {
      for (int col = 0; col < board.cols; ++col) {
        if (static_cast<int>(random() % 100) < share_percent) cells.insert({row, col});
      }
    }
    for (const int least : {2, 5, 12}) {
      const std::set<Position> expected = LargeByLabels(cells, least);
      EXPECT_LT(expected.size(), cells.size()) << "something is to be dropped";
      EXPECT_EQ(Left(board, cells, least), expected) << share_percent << " % " << least;
    }
  }
}

TEST(SmallComponents, AreConnectedByEdgesOnly) {
  const Board board = PlainBoard(10, 10);
  const std::set<Position> diagonal = {{1, 1}, {2, 2}, {3, 3}, {4, 4}};
  EXPECT_TRUE(Left(board, diagonal, 2).empty());
  const std::set<Position> stairs = {{1, 1}, {1, 2}, {2, 2}, {2, 3}};
  EXPECT_EQ(Left(board, stairs, 4), stairs);
  EXPECT_TRUE(Left(board, stairs, 5).empty());
}

// The smallest strip that stays in a view of `cells` cells, most of them in one block.
int LeastIn(size_t cells, int least_of_few) {
  constexpr int kLongest = 60;
  const Board board = PlainBoard(400, 500);
  std::set<Position> view;
  for (int length = 1; length <= kLongest; ++length) {
    for (int k = 0; k < length; ++k) view.insert({2 * length, k});
  }
  for (int k = 0; view.size() < cells; ++k) view.insert({k / 400, 100 + k % 400});
  const std::set<Position> left = Left(board, view, least_of_few);
  for (int length = 1; length <= kLongest; ++length) {
    if (left.contains({2 * length, 0})) return length;
  }
  return kLongest + 1;
}

TEST(SmallComponents, MustBeLargerInLargerViews) {
  constexpr int kLeast = 9;
  // Strips of up to 60 are 1830 cells.
  EXPECT_EQ(LeastIn(2000, kLeast), kLeast + 3);  // 4.4 ln 2
  EXPECT_EQ(LeastIn(20000, kLeast), kLeast + 13);
  EXPECT_EQ(LeastIn(100000, kLeast), kLeast + 20);
  EXPECT_EQ(LeastIn(20000, 2 * kLeast), 2 * kLeast + 13);
}

TEST(SmallComponents, OfAViewOfAThousandCellsKeepTheLimit) {
  const Board board = PlainBoard(60, 60);
  std::set<Position> view = {{50, 1}, {50, 2}, {50, 3}, {55, 1}, {55, 2}};
  for (int k = 0; view.size() < 1000; ++k) view.insert({k / 30, k % 30});
  std::set<Position> left = view;
  left.erase({55, 1});
  left.erase({55, 2});
  EXPECT_EQ(Left(board, view, 3), left);
}

TEST(LargestComponent, IsConnectedByEdges) {
  const Board board = PlainBoard(20, 20);
  BoardState state(board, 100, 100);
  EXPECT_EQ(LargestComponent(state), 0);
  for (const auto& [row, col] : {Position{1, 1}, {1, 2}, {2, 3}, {2, 4}, {3, 4}})
    state.Add({row, col, {}, 0, 0, 1});
  EXPECT_EQ(LargestComponent(state), 3);
}

TEST(SmallComponents, MustBeLargerWhereMoreWasSearched) {
  const Board board = PlainBoard(20, 20);
  BoardState state(board, 100, 100);
  for (int k = 0; k < 12; ++k) state.Add({1, k, {}, 0, 0, 1});
  DropSmallComponents(9, 2000, &state);
  EXPECT_EQ(state.cells().size(), 12u);  // 9 + 3
  DropSmallComponents(9, 3000, &state);
  EXPECT_TRUE(state.cells().empty());
}

}  // namespace
}  // namespace weft
