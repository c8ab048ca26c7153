#include "services/studio/print/print_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace weft {
namespace {

using ::testing::HasSubstr;

Board PlainBoard(int rows, int cols) {
  Board board = *GenerateBoard(rows, cols, 2.5, 1);
  board.square_fraction = 0.8;
  return board;
}

TEST(PrintLayout, OnePageWhereTheBoardFits) {
  const auto layout = LayOutBoard(PlainBoard(100, 200), {});
  ASSERT_TRUE(layout.ok()) << layout.status();
  ASSERT_EQ(layout->pages.size(), 1u);
  EXPECT_NEAR(layout->ink_line_mm, 0.5, 1e-12);
  EXPECT_EQ(layout->pages[0].pieces[0].rows, 100);
  EXPECT_EQ(layout->pages[0].pieces[0].cols, 200);
  EXPECT_TRUE(layout->pages[0].pieces[0].mark_cols.empty());
}

TEST(PrintLayout, TilesCoverTheBoardAndOverlap) {
  PrintOptions options;
  options.page_width_mm = 400;
  options.page_height_mm = 300;
  options.overlap_mm = 24;  // 10 cells of 2.5 mm
  const Board board = PlainBoard(150, 333);
  const auto layout = LayOutBoard(board, options);
  ASSERT_TRUE(layout.ok()) << layout.status();
  ASSERT_GT(layout->pages.size(), 4u);
  std::vector<int> times(150 * 333, 0);
  for (const PrintPage& page : layout->pages) {
    EXPECT_LE(page.width_mm, 400);
    EXPECT_EQ(page.height_mm, 300);
    const PrintPiece& piece = page.pieces[0];
    EXPECT_LE(piece.x_mm + piece.cols * 2.5, 400 - options.margin_mm);
    EXPECT_LE(piece.y_mm + piece.rows * 2.5, 300 - options.margin_mm);
    for (int r = 0; r < piece.rows; ++r)
      for (int c = 0; c < piece.cols; ++c) ++times[(piece.row + r) * 333 + piece.col + c];
  }
  for (const int t : times) EXPECT_GE(t, 1);
  const PrintPiece &first = layout->pages[0].pieces[0], &second = layout->pages[1].pieces[0];
  EXPECT_EQ(first.col + first.cols - second.col, 10);
  // The same places of the board are marked on both.
  EXPECT_EQ(first.mark_cols, (std::vector<int>{second.col, first.cols}));
  EXPECT_EQ(second.mark_cols[0], second.col);
  EXPECT_EQ(second.mark_cols[1], first.cols);
}

TEST(PrintLayout, PanelsWithAllowanceDoNotOverlap) {
  Board board = PlainBoard(120, 160);
  board.panels.assign(120 * 160, 0);
  for (int r = 0; r < 120; ++r)
    for (int c = 0; c < 160; ++c)
      if (r >= 4 && r < 100) board.panels[160 * r + c] = c < 40 ? 1 : (c < 90 ? 2 : (c > 100 ? 3 : 0));
  PrintOptions options;
  options.page_width_mm = 420;
  options.seam_allowance_mm = 9;
  const auto layout = LayOutBoard(board, options);
  ASSERT_TRUE(layout.ok()) << layout.status();
  EXPECT_EQ(layout->allowance_cells, 4);
  std::set<int> panels;
  for (const PrintPage& page : layout->pages) {
    for (size_t i = 0; i < page.pieces.size(); ++i) {
      const PrintPiece& a = page.pieces[i];
      panels.insert(a.panel);
      EXPECT_LE(a.x_mm + a.cols * 2.5, page.width_mm);
      EXPECT_LE(a.y_mm + a.rows * 2.5, page.height_mm);
      EXPECT_EQ(a.rows, 96 + 8);
      for (size_t k = 0; k < i; ++k) {
        const PrintPiece& b = page.pieces[k];
        const bool apart = a.x_mm + a.cols * 2.5 < b.x_mm || b.x_mm + b.cols * 2.5 < a.x_mm ||
                           a.y_mm + a.rows * 2.5 < b.y_mm || b.y_mm + b.rows * 2.5 < a.y_mm;
        EXPECT_TRUE(apart);
      }
      // The allowance is a ring as wide as it is asked for, the panel inside is whole.
      const std::vector<uint8_t> cells = PieceCells(board, a, 4);
      EXPECT_EQ(cells[a.cols * 4 + 4], 2);
      EXPECT_EQ(cells[a.cols * 4], 1);
      EXPECT_EQ(cells[0], 0);  // the corner of the ring is round
    }
  }
  EXPECT_EQ(panels, (std::set<int>{1, 2, 3}));
}

TEST(PrintLayout, SaysWhatDoesNotFit) {
  Board board = PlainBoard(100, 200);
  PrintOptions options;
  options.page_width_mm = 200;
  EXPECT_THAT(LayOutBoard(board, options).status().message(), HasSubstr("page_width_mm"));
  options = {};
  options.page_height_mm = 120;
  EXPECT_THAT(LayOutBoard(board, options).status().message(), HasSubstr("page_height_mm"));
  options = {};
  options.ink_line_mm = 2.4;
  EXPECT_THAT(LayOutBoard(board, options).status().message(), HasSubstr("ink_line_mm"));
  board.cell_mm = 0;
  EXPECT_THAT(LayOutBoard(board, {}).status().message(), HasSubstr("--cell-mm"));
  board = PlainBoard(100, 200);
  board.panels.assign(100 * 200, 1);
  options = {};
  options.page_width_mm = 400;
  EXPECT_THAT(LayOutBoard(board, options).status().message(), HasSubstr("panel 1 with its seam allowance"));
}

// Two panels of 40 x 60 cells that do not fit beside each other.
TEST(PrintLayout, PanelsGoToTheNextShelfAndTheNextPage) {
  Board board = PlainBoard(60, 160);
  board.panels.assign(60 * 160, 0);
  for (int row = 10; row < 50; ++row)
    for (int col = 0; col < 60; ++col)
      board.panels[static_cast<size_t>(160 * row + col + 5)] = 1, board.panels[static_cast<size_t>(
                                                                      160 * row + col + 90)] = 2;
  PrintOptions options;
  options.page_width_mm = 350;
  options.seam_allowance_mm = 0;
  auto layout = LayOutBoard(board, options);
  ASSERT_TRUE(layout.ok()) << layout.status();
  ASSERT_EQ(layout->pages.size(), 1u);
  EXPECT_EQ(layout->pages[0].height_mm, 91 + 2 * (100 + 14) + 15);
  ASSERT_EQ(layout->pages[0].pieces.size(), 2u);
  const PrintPiece &first = layout->pages[0].pieces[0], &second = layout->pages[0].pieces[1];
  EXPECT_EQ(first.label, "panel 1");
  EXPECT_EQ(first.row, 10);
  EXPECT_EQ(first.col, 5);
  EXPECT_EQ(first.rows, 40);
  EXPECT_EQ(first.cols, 60);
  EXPECT_EQ(first.x_mm, 15 + 14);
  EXPECT_EQ(first.y_mm, 15 + 62 + 14);
  EXPECT_EQ(second.col, 90);
  EXPECT_EQ(second.x_mm, first.x_mm);
  EXPECT_EQ(second.y_mm, first.y_mm + 100 + 14);
  // On a page that is as wide, both stand beside each other.
  options.page_width_mm = 29 + 2 * (150 + 14) + 15;
  layout = LayOutBoard(board, options);
  EXPECT_EQ(layout->pages[0].height_mm, 91 + 100 + 14 + 15);
  EXPECT_EQ(layout->pages[0].pieces[1].x_mm, 29 + 150 + 14);
  options.page_width_mm = 350;
  options.page_height_mm = 91 + 100 + 14 + 15;
  layout = LayOutBoard(board, options);
  ASSERT_TRUE(layout.ok()) << layout.status();
  ASSERT_EQ(layout->pages.size(), 2u);
  for (const PrintPage& page : layout->pages) {
    EXPECT_EQ(page.width_mm, 350);
    EXPECT_EQ(page.height_mm, 220);
    ASSERT_EQ(page.pieces.size(), 1u);
    EXPECT_EQ(page.pieces[0].x_mm, 29);
    EXPECT_EQ(page.pieces[0].y_mm, 91);
  }
  options.page_height_mm = 219;
  EXPECT_THAT(LayOutBoard(board, options).status().message(),
              HasSubstr("panel 1 with its seam allowance measures 150 x 100 mm and does not fit the page"));
}

TEST(PrintOptions, AreThoseOfAPageWithAHead) {
  const auto why = [](const PrintOptions& options) { return std::string(options.Validate().message()); };
  EXPECT_EQ(why({}), "");
  EXPECT_EQ(why({.page_width_mm = 330, .page_height_mm = 99999, .margin_mm = 15, .overlap_mm = 0}), "");
  EXPECT_EQ(why({.page_width_mm = 329}), "page_width_mm must leave 300 mm between the margins for the head");
  for (const double width_mm : {0.0, -1.0, 1e5})
    EXPECT_THAT(why({.page_width_mm = width_mm}), HasSubstr("page_width_mm must lie between")) << width_mm;
  for (const double height_mm : {-1.0, 1e5})
    EXPECT_THAT(why({.page_height_mm = height_mm}), HasSubstr("page_height_mm must lie in")) << height_mm;
  EXPECT_THAT(why({.margin_mm = -1}), HasSubstr("margin_mm"));
  EXPECT_THAT(why({.ink_line_mm = NAN}), HasSubstr("ink_line_mm"));
  EXPECT_THAT(why({.overlap_mm = -1}), HasSubstr("overlap_mm"));
  EXPECT_THAT(why({.seam_allowance_mm = -1}), HasSubstr("seam_allowance_mm"));
}

}  // namespace
}  // namespace weft
