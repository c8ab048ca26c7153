#include "pattern/board/joint_board.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pattern/board/board_index.h"
#include "tests/pattern/board/boards_apart.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(JoinBoards, KeepsEachBoardInItsRows) {
  const Board shirt = BoardApartFrom({}, 20, 30, 1);
  Board skirt = BoardApartFrom({shirt}, 15, 24, 2);
  skirt.panels.assign(skirt.cells.size(), 0);
  for (int row = 0; row < 15; ++row)
    for (int col = 0; col < 24; ++col) skirt.panels[24 * row + col] = col < 10 ? 1 : col > 12 ? 2 : 0;
  skirt.cell_mm = 4;
  const auto joint = JoinBoards({shirt, skirt});
  ASSERT_TRUE(joint.ok()) << joint.status();
  EXPECT_EQ(joint->rows, 20 + kRowsBetweenParts + 15);
  EXPECT_EQ(joint->cols, 30);
  EXPECT_EQ(joint->cell_mm, 0);
  EXPECT_EQ(joint->PartAt(19), 0);
  EXPECT_EQ(joint->PartAt(20), -1);
  EXPECT_EQ(joint->PartAt(20 + kRowsBetweenParts), 1);
  const Board first = PartOfBoard(*joint, 0), second = PartOfBoard(*joint, 1);
  EXPECT_EQ(first.ContentHash(), shirt.ContentHash());
  EXPECT_EQ(first.panels, shirt.panels);
  EXPECT_EQ(second.ContentHash(), skirt.ContentHash());
  EXPECT_EQ(second.panels, skirt.panels);
  EXPECT_EQ(second.cell_mm, 4);
  EXPECT_EQ(second.id, skirt.id);
}

// Independent of FindClashes: the index of the joint board finds each window at its own place.
TEST(JoinBoards, WindowsOfBoardsMadeApartAreUniqueOverAll) {
  const Board shirt = BoardApartFrom({}, 60, 90, 1), skirt = BoardApartFrom({shirt}, 50, 90, 1);
  const auto joint = JoinBoards({shirt, skirt});
  ASSERT_TRUE(joint.ok()) << joint.status();
  const auto index = BoardIndex::Build(*joint);
  ASSERT_TRUE(index.ok()) << index.status();
  for (int row = 0; row + 3 <= skirt.rows; ++row) {
    for (int col = 0; col + 3 <= skirt.cols; ++col) {
      const auto pose = index->Find(BoardWindow(skirt, row, col));
      ASSERT_TRUE(pose.has_value());
      EXPECT_EQ(pose->row, row + shirt.rows + kRowsBetweenParts);
      EXPECT_EQ(pose->col, col);
    }
  }
}

TEST(JoinBoards, ClashesShowWhereBoardsWereNotMadeApart) {
  // The corner of one board again in the other.
  const Board shirt = BoardApartFrom({}, 30, 30, 1);
  Board skirt = BoardApartFrom({shirt}, 30, 30, 2);
  for (int i = 0; i < 9; ++i) skirt.cells[30 * (4 + i / 3) + 5 + i % 3] = shirt.at(i / 3, i % 3);
  const auto joint = JoinBoards({shirt, skirt});
  ASSERT_TRUE(joint.ok()) << joint.status();
  const std::vector<CodeClash> clashes = joint->FindClashes(100);
  const auto ours = std::find_if(clashes.begin(), clashes.end(), [&](const CodeClash& c) {
    return c.row_a == 0 && c.col_a == 0 && c.row_b == shirt.rows + kRowsBetweenParts + 4 && c.col_b == 5;
  });
  EXPECT_NE(ours, clashes.end());
}

TEST(JoinBoards, RefusesWhatCannotBeToldApart) {
  const Board shirt = BoardApartFrom({}, 12, 12, 1), skirt = BoardApartFrom({shirt}, 12, 12, 2);
  EXPECT_THAT(JoinBoards({shirt}).status().message(), HasSubstr("two boards or more"));
  EXPECT_THAT(JoinBoards({shirt, skirt, shirt}).status().message(), HasSubstr("same print"));
  EXPECT_THAT(JoinBoards({*JoinBoards({shirt, skirt}), BoardApartFrom({}, 9, 9, 3)}).status().message(),
              HasSubstr("joint board itself"));
  Board thin = skirt;
  thin.square_fraction = 0.6;
  EXPECT_THAT(JoinBoards({shirt, thin}).status().message(), HasSubstr("square_fraction is 0.75"));
}

TEST(Board, PartsMustLieOnIt) {
  Board joint = *JoinBoards({BoardApartFrom({}, 12, 12, 1), BoardApartFrom({}, 12, 12, 2)});
  joint.parts[1].first_row = 11;
  EXPECT_THAT(joint.Validate().message(), HasSubstr("parts[1]"));
}

}  // namespace
}  // namespace weft
