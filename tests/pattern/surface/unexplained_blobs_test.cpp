#include "pattern/surface/unexplained_blobs.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "pattern/board/board.h"

namespace weft {
namespace {

constexpr int kBlobsSidePx = 200;
constexpr float kCellPx = 9;

// Cells of kCellPx, side by side and turned by a few degrees; every third one is missing.
BoardState SomeCells(const Board& board) {
  BoardState state(board, kBlobsSidePx, kBlobsSidePx);
  for (int row = 0; row < 12; ++row) {
    for (int col = 0; col < 12; ++col) {
      if ((row + col) % 3 == 0) continue;
      ViewCell cell{.row = row, .col = col};
      const auto x = static_cast<float>(col), y = static_cast<float>(row);
      cell.fit.pose = {30 + kCellPx * (x - 0.1f * y),
                       25 + kCellPx * (y + 0.1f * x),
                       kCellPx,
                       0.1f * kCellPx,
                       -0.1f * kCellPx,
                       kCellPx};
      state.Add(cell);
    }
  }
  return state;
}

TEST(UnexplainedBlobs, AreThoseThatLieInNoCellInTheirOrder) {
  const Board board = *GenerateBoard(20, 20, 3, 1);
  const BoardState state = SomeCells(board);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(0, kBlobsSidePx - 1);
  std::vector<LooseBlob> blobs;
  for (int k = 0; k < 2000; ++k) blobs.push_back({place(random), place(random), 0});
  std::vector<LooseBlob> expected;
  for (const LooseBlob& blob : blobs) {
    bool inside = false;
    for (const ViewCell& cell : state.cells())
      inside |= cell.fit.pose.Contains(blob.x_px - cell.fit.pose.x, blob.y_px - cell.fit.pose.y);
    if (!inside) expected.push_back(blob);
  }
  const std::vector<LooseBlob> found = UnexplainedBlobs(state, blobs);
  ASSERT_EQ(found.size(), expected.size());
  EXPECT_LT(found.size(), blobs.size() - 200);
  for (size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(found[k].x_px, expected[k].x_px);
    EXPECT_EQ(found[k].y_px, expected[k].y_px);
  }
}

TEST(UnexplainedBlobs, AreAllWhereNothingIsKnown) {
  const Board board = *GenerateBoard(20, 20, 3, 1);
  const BoardState state(board, kBlobsSidePx, kBlobsSidePx);
  EXPECT_EQ(UnexplainedBlobs(state, {{3, 4, 0}, {150, 20, 1}}).size(), 2u);
  EXPECT_TRUE(UnexplainedBlobs(SomeCells(board), {}).empty());
}

}  // namespace
}  // namespace weft
