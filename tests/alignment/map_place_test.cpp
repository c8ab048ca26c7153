#include "alignment/map_place.h"

#include <gtest/gtest.h>

#include <functional>

namespace weft {
namespace {

constexpr int kPlaceRows = 60, kPlaceCols = 90;

Board ABoard() {
  return {"board", kPlaceRows, kPlaceCols,
          3,       0.75,       std::vector<CellColor>(size_t{kPlaceRows} * kPlaceCols, CellColor{})};
}

// Two panels that are not as large as the board, nor in its middle.
bool IsOfTheGarment(int row, int col) {
  return (row >= 4 && row < 40 && col >= 5 && col < 45) || (row >= 10 && row < 50 && col >= 50 && col < 80);
}

using Move = std::function<VertexNode(int row, int col)>;

Template MapOf(const Move& move) {
  Template garment;
  for (int row = 0; row < kPlaceRows; ++row)
    for (int col = 0; col < kPlaceCols; ++col)
      if (IsOfTheGarment(row, col)) garment.node_of_vertex.push_back(move(row, col));
  garment.node_of_vertex.push_back({});
  return garment;
}

Cloud Seen(const std::function<bool(int row, int col)>& is_seen) {
  Cloud cloud;
  for (int row = 0; row < kPlaceRows; ++row) {
    for (int col = 0; col < kPlaceCols; ++col) {
      if (!IsOfTheGarment(row, col) || !is_seen(row, col)) continue;
      CloudPoint point;
      point.node = {row, col, NodeKind::kCenter};
      cloud.points.push_back(point);
      point.node.kind = NodeKind::kCorner;  // which says nothing
      cloud.points.push_back(point);
    }
  }
  return cloud;
}

bool EveryCell(int, int) { return true; }
bool OnOneSide(int row, int col) { return row < 30 && (row + col) % 3 != 0; }

VertexNode Same(int row, int col) { return {row, col, NodeKind::kCenter}; }

TEST(FindOtherPlace, ARightMapFitsWhereItIs) {
  for (const auto& seen : {EveryCell, OnOneSide})
    EXPECT_FALSE(FindOtherPlace(MapOf(Same), ABoard(), Seen(seen)));
  // Without the cells at its borders.
  const auto inner = [](int row, int col) {
    return IsOfTheGarment(row - 1, col) && IsOfTheGarment(row, col - 1) && IsOfTheGarment(row + 1, col) &&
                   IsOfTheGarment(row, col + 1)
               ? Same(row, col)
               : VertexNode{};
  };
  EXPECT_FALSE(FindOtherPlace(MapOf(inner), ABoard(), Seen(EveryCell)));
  const auto without_a_row = [](int row, int col) { return row == 39 ? VertexNode{} : Same(row, col); };
  EXPECT_FALSE(FindOtherPlace(MapOf(without_a_row), ABoard(), Seen(EveryCell)));
  // Of one panel, while another garment of the board is in sight.
  const auto of_one = [](int row, int col) { return col < 50 ? Same(row, col) : VertexNode{}; };
  EXPECT_FALSE(FindOtherPlace(MapOf(of_one), ABoard(), Seen(EveryCell)));
}

TEST(FindOtherPlace, MapsThatCountFromOneAreMovedBack) {
  for (const int by : {1, -1}) {
    const auto moved = [by](int row, int col) { return VertexNode{row + by, col + by, NodeKind::kCenter}; };
    for (const auto& seen : {EveryCell, OnOneSide}) {
      const auto place = FindOtherPlace(MapOf(moved), ABoard(), Seen(seen));
      ASSERT_TRUE(place) << by;
      EXPECT_EQ(place->rows, -by);
      EXPECT_EQ(place->cols, -by);
      EXPECT_FALSE(place->half_turn);
      EXPECT_EQ(place->outside_there, 0);
    }
  }
}

TEST(FindOtherPlace, RowsAloneThatCountFromOneAreMovedBack) {
  const auto moved = [](int row, int col) { return VertexNode{row + 1, col, NodeKind::kCenter}; };
  const auto place = FindOtherPlace(MapOf(moved), ABoard(), Seen(EveryCell));
  ASSERT_TRUE(place);
  EXPECT_EQ(place->rows, -1);
  EXPECT_EQ(place->cols, 0);
}

TEST(FindOtherPlace, MapsThatCountFromTheFarCornerAreTurned) {
  const auto turned = [](int row, int col) {
    return VertexNode{kPlaceRows - 1 - row, kPlaceCols - 1 - col, NodeKind::kCenter};
  };
  const auto place = FindOtherPlace(MapOf(turned), ABoard(), Seen(EveryCell));
  ASSERT_TRUE(place);
  EXPECT_TRUE(place->half_turn);
  EXPECT_EQ(place->outside_there, 0);
  EXPECT_GT(place->outside, 100);
}

TEST(FindOtherPlace, LittleSaysNothing) {
  const auto moved = [](int row, int col) { return VertexNode{row + 1, col + 1, NodeKind::kCenter}; };
  const auto some = [](int row, int col) { return (7 * row + 11 * col) % 13 == 0; };
  EXPECT_FALSE(FindOtherPlace(MapOf(moved), ABoard(), Seen(some)));
}

}  // namespace
}  // namespace weft
