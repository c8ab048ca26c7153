// What stands where on a printed page, measured in a picture of ten pixels a millimetre.
#include "services/studio/print/print_drawing.h"

#include <cairo.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "services/studio/print/print_layout.h"

namespace weft {
namespace {

constexpr double kScale = 10;
using PageRgb = std::array<int, 3>;
constexpr PageRgb kWhitePage = {255, 255, 255}, kBlackInk = {0, 0, 0};

PageRgb InkOf(CellColor color) {
  const auto rgb = CellColorRgb(color);
  return {rgb[0], rgb[1], rgb[2]};
}

// One piece of 4 x 6 cells of 10 mm, at (20, 90) mm.
class PrintDrawingTest : public ::testing::Test {
 protected:
  PrintDrawingTest() {
    board_.rows = 4;
    board_.cols = 6;
    board_.cell_mm = 10;
    for (int i = 0; i < 24; ++i) board_.cells.push_back(static_cast<CellColor>((i + i / 6) % kCellColors));
    layout_.cell_mm = 10;
    layout_.ink_line_mm = 2;
    PrintPage& page = layout_.pages.emplace_back();
    page.width_mm = 330;
    page.height_mm = 160;
    PrintPiece& piece = page.pieces.emplace_back();
    piece.label = "tile";
    piece.x_mm = 20;
    piece.y_mm = 90;
    piece.rows = 4;
    piece.cols = 6;
  }
  PrintPiece& piece() { return layout_.pages[0].pieces[0]; }

  void Draw() {
    surface_.reset(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(330 * kScale),
                                              static_cast<int>(160 * kScale)));
    const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface_.get()),
                                                                     &cairo_destroy);
    cairo_set_source_rgb(context.get(), 1, 1, 1);
    cairo_paint(context.get());
    cairo_scale(context.get(), kScale, kScale);
    DrawPrintPage(board_, layout_, 1, context.get());
    cairo_surface_flush(surface_.get());
  }
  PageRgb At(double x_mm, double y_mm) const {
    const unsigned char* row =
        cairo_image_surface_get_data(surface_.get()) +
        cairo_image_surface_get_stride(surface_.get()) * static_cast<int>(y_mm * kScale);
    const unsigned char* pixel = row + 4 * static_cast<int>(x_mm * kScale);
    return {pixel[2], pixel[1], pixel[0]};
  }
  // Any ink within half a millimetre.
  bool HasInk(double x_mm, double y_mm) const {
    for (double dy = -0.5; dy <= 0.5; dy += 0.1)
      for (double dx = -0.5; dx <= 0.5; dx += 0.1)
        if (At(x_mm + dx, y_mm + dy) != kWhitePage) return true;
    return false;
  }
  bool HasInkIn(double left, double top, double right, double bottom) const {
    for (double y = top; y < bottom; y += 0.1)
      for (double x = left; x < right; x += 0.1)
        if (At(x, y) != kWhitePage) return true;
    return false;
  }

  Board board_;
  PrintLayout layout_;
  std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface_{nullptr,
                                                                              &cairo_surface_destroy};
};

TEST_F(PrintDrawingTest, EveryCellHasItsColourBetweenLines) {
  Draw();
  for (int row = 0; row < 4; ++row)
    for (int col = 0; col < 6; ++col) {
      const double x = 20 + 10 * col, y = 90 + 10 * row;
      const PageRgb ink = InkOf(board_.at(row, col));
      EXPECT_EQ(At(x + 5, y + 5), ink);
      EXPECT_EQ(At(x + 1.15, y + 5), ink);  // lines are 1 mm wide on each side of the border
      EXPECT_EQ(At(x + 0.85, y + 5), kBlackInk);
      EXPECT_EQ(At(x + 8.85, y + 5), ink);
      EXPECT_EQ(At(x + 9.15, y + 5), kBlackInk);
      EXPECT_EQ(At(x + 5, y + 1.15), ink);
      EXPECT_EQ(At(x + 5, y + 0.85), kBlackInk);
    }
  EXPECT_EQ(At(19.5, 95), kWhitePage);
  EXPECT_EQ(At(80.5, 95), kWhitePage);
  layout_.ink_line_mm = 0;
  Draw();
  EXPECT_EQ(At(20.15, 95), InkOf(board_.at(0, 0)));
}

// A piece that begins at another cell, and reaches beyond the board.
TEST_F(PrintDrawingTest, PiecesShowTheirPartOfTheBoard) {
  piece().row = 2;
  piece().col = 3;
  Draw();
  EXPECT_EQ(At(25, 95), InkOf(board_.at(2, 3)));
  EXPECT_EQ(At(45, 105), InkOf(board_.at(3, 5)));
  EXPECT_EQ(At(55, 95), kWhitePage);
  EXPECT_EQ(At(25, 115), kWhitePage);
}

TEST_F(PrintDrawingTest, TheHeadShowsEveryInkAndTheLines) {
  Draw();
  for (int i = 0; i <= kCellColors; ++i) {
    const PageRgb ink = i < kCellColors ? InkOf(static_cast<CellColor>(i)) : kBlackInk;
    EXPECT_EQ(At(20 + 24 * i + 0.3, 35), ink) << i;
    EXPECT_EQ(At(20 + 24 * i + 19.7, 35), ink) << i;
    EXPECT_EQ(At(20 + 24 * i + 22, 35), kWhitePage) << i;
    EXPECT_TRUE(HasInkIn(20 + 24 * i, 46.5, 20 + 24 * i + 10, 49.5)) << "its name";
  }
  EXPECT_EQ(At(30, 25.3), InkOf(CellColor::kRed));
  EXPECT_EQ(At(30, 44.7), InkOf(CellColor::kRed));
  // Pieces that lie further to the right leave the head where it is.
  piece().x_mm = 60;
  Draw();
  EXPECT_EQ(At(29.3, 35), InkOf(CellColor::kRed));
  EXPECT_EQ(At(28.5, 35), kWhitePage);
  layout_.pages[0].pieces.clear();
  Draw();
  EXPECT_EQ(At(15.3, 35), InkOf(CellColor::kRed));
}

TEST_F(PrintDrawingTest, BarsAre200And40MillimetresWithTicksOf10) {
  Draw();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(At(20 + 10 * i + 5, 58.5), i % 2 == 0 ? kBlackInk : kWhitePage) << i;
  EXPECT_TRUE(HasInk(219.9, 58.5));
  EXPECT_EQ(At(220.2, 58.5), kWhitePage);
  EXPECT_EQ(At(19.8, 58.5), kWhitePage);
  // Upright, to the right of the swatches.
  for (int i = 0; i < 4; ++i) EXPECT_EQ(At(239.5, 21 + 10 * i + 5), i % 2 == 0 ? kBlackInk : kWhitePage) << i;
  EXPECT_TRUE(HasInk(239.5, 60.9));
  EXPECT_EQ(At(239.5, 61.2), kWhitePage);
  EXPECT_EQ(At(239.5, 20.8), kWhitePage);
  EXPECT_TRUE(HasInkIn(244, 40, 255, 43.5)) << "its length in words";
}

TEST_F(PrintDrawingTest, MarksStandBesideTheTileWhereOthersBegin) {
  piece().row = 1;
  piece().col = 2;
  piece().mark_cols = {4};
  piece().mark_rows = {3};
  Draw();
  // A cross of 8 mm with a circle of 4 mm across, 7 mm beside the tile.
  for (const auto& [x, y] :
       {std::pair{40.0, 83.0}, std::pair{40.0, 137.0}, std::pair{13.0, 110.0}, std::pair{87.0, 110.0}}) {
    EXPECT_NE(At(x, y), kWhitePage);
    for (const double d : {-3.8, 3.8}) {
      EXPECT_TRUE(HasInk(x + d, y)) << x << " " << y;
      EXPECT_TRUE(HasInk(x, y + d)) << x << " " << y;
    }
    EXPECT_TRUE(HasInk(x + 1.41, y + 1.41));
    EXPECT_FALSE(HasInk(x + 5, y));
  }
  EXPECT_FALSE(HasInkIn(20, 80, 34, 86));
}

TEST_F(PrintDrawingTest, TilesHaveTheirNameBelowBesideTheMarks) {
  Draw();
  EXPECT_TRUE(HasInkIn(20, 132, 30, 135.5));
  EXPECT_FALSE(HasInkIn(70, 132, 80, 135.5));
  piece().mark_cols = {3};
  Draw();
  EXPECT_TRUE(HasInkIn(70, 132, 80, 135.5));
  EXPECT_FALSE(HasInkIn(20, 132, 30, 135.5));
}

// A panel of the 2 x 4 cells in the middle, with an allowance of one cell.
TEST_F(PrintDrawingTest, PanelsHaveASeamAndACut) {
  board_.panels.assign(24, 0);
  for (int row = 1; row < 3; ++row)
    for (int col = 1; col < 5; ++col) board_.panels[static_cast<size_t>(6 * row + col)] = 1;
  layout_.allowance_cells = 1;
  layout_.ink_line_mm = 1;
  piece().panel = 1;
  Draw();
  // The cut is 0.4 mm wide, half of it outside.
  EXPECT_EQ(At(50, 89.85), kBlackInk);
  EXPECT_EQ(At(50, 89.6), kWhitePage);
  EXPECT_EQ(At(50, 130.1), kBlackInk);
  EXPECT_EQ(At(50, 130.3), kWhitePage);
  EXPECT_EQ(At(19.9, 110.5), kBlackInk);
  EXPECT_EQ(At(80.1, 110.5), kBlackInk);
  // White dashes of 3 mm along the seam, on the black line.
  int white = 0, black = 0;
  for (double x = 30.05; x < 70; x += 0.1) {
    white += At(x, 100) == kWhitePage;
    black += At(x, 100) == kBlackInk;
  }
  EXPECT_NEAR(white, 200, 40);
  EXPECT_NEAR(black, 200, 40);
  EXPECT_EQ(At(50, 110), kBlackInk) << "no seam within the panel";
  EXPECT_EQ(At(45, 99), InkOf(board_.at(0, 2)));
}

// Without room on the piece its name stands below, and a line leads to it.
TEST_F(PrintDrawingTest, ALineLeadsFromTheNameToThePanel) {
  board_.panels.assign(24, 1);
  piece().panel = 1;
  Draw();
  const double middle_mm = 20 + (0.68 * 4 + 0.4) * 3.5 / 2;
  EXPECT_TRUE(HasInk(middle_mm, 132));
  EXPECT_TRUE(HasInk(middle_mm, 133.3));
  EXPECT_FALSE(HasInk(middle_mm - 1.5, 132));
  EXPECT_FALSE(HasInk(middle_mm + 1.5, 132));
  EXPECT_TRUE(HasInkIn(21, 134.2, 30, 138)) << "the name";
}

}  // namespace
}  // namespace weft
