#include "simulation/worn_together.h"

#include <gtest/gtest.h>

#include <set>

#include "alignment/untangle/self_intersection.h"
#include "pattern/board/joint_board.h"

namespace weft {
namespace {

TEST(ShirtAndSkirt, StartsFreeOfIntersections) {
  for (const double cell_mm : {20.0, 11.0, 6.0}) {
    const auto outfit = MakeShirtAndSkirt(cell_mm);
    ASSERT_TRUE(outfit.ok()) << outfit.status();
    EXPECT_TRUE(FindSelfIntersections(outfit->start_mm, outfit->sewn.garment.rest.faces).empty()) << cell_mm;
  }
}

TEST(ShirtAndSkirt, EachGarmentHasItsOwnVerticesAndRowsOfTheBoard) {
  const auto skirt = MakeSkirt(12);
  const auto both = MakeShirtAndSkirt(12);
  ASSERT_TRUE(both.ok()) << both.status();
  const Garment& garment = both->sewn.garment;
  ASSERT_EQ(garment.worn.size(), 2);
  const WornGarment &inner = garment.worn[0], &outer = garment.worn[1];
  EXPECT_EQ(inner.name, "skirt");
  EXPECT_EQ(inner.vertices, static_cast<int>(skirt->start_mm.size()));
  EXPECT_EQ(outer.first_vertex, inner.vertices);
  EXPECT_EQ(outer.first_row, inner.rows + kRowsBetweenParts);
  EXPECT_EQ(outer.first_row + outer.rows, garment.board_rows);
  EXPECT_EQ(outer.first_face + outer.faces, static_cast<int>(garment.rest.faces.size()));
  std::set<std::pair<int, int>> cells;
  for (size_t v = 0; v < garment.cell_of_vertex.size(); ++v) {
    const VertexNode& cell = garment.cell_of_vertex[v];
    if (!cell.IsCell()) continue;
    EXPECT_TRUE(cells.insert({cell.row, cell.col}).second);
    const WornGarment& worn = static_cast<int>(v) < outer.first_vertex ? inner : outer;
    EXPECT_GE(cell.row, worn.first_row);
    EXPECT_LT(cell.row, worn.first_row + worn.rows);
    EXPECT_LT(cell.col, worn.cols);
  }
  // The waist is the skirt's, and the shirt hangs over it.
  double waist_mm = 0, hem_mm = 0;
  for (const int v : both->waist) {
    EXPECT_LT(v, inner.vertices);
    waist_mm = std::max(waist_mm, both->start_mm[v].y());
  }
  for (int v = outer.first_vertex; v < outer.first_vertex + outer.vertices; ++v)
    hem_mm = std::max(hem_mm, both->start_mm[v].y());
  EXPECT_GT(hem_mm, waist_mm + 80);
}

}  // namespace
}  // namespace weft
