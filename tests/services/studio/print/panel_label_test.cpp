#include "services/studio/print/panel_label.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pattern/board/board_generation.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

// Panels: a square, a strip three columns wide, a patch of 4x4 cells, a triangle.
Board BoardOfPanels() {
  Board board = *GenerateBoard(60, 100, 2.7, 1);
  board.panels.assign(60 * 100, 0);
  const auto set = [&](int panel, int row, int col) {
    board.panels[static_cast<size_t>(100) * row + col] = panel;
  };
  for (int r = 5; r < 55; ++r) {
    for (int c = 5; c < 45; ++c) set(1, r, c);
    if (r < 40)
      for (int c = 60; c < 63; ++c) set(2, r, c);
    for (int c = 70; c < 95 && r - 5 >= c - 70; ++c) set(4, r, c);
  }
  for (int r = 46; r < 50; ++r)
    for (int c = 55; c < 59; ++c) set(3, r, c);
  return board;
}

struct Labelled {
  PrintLayout layout;
  std::vector<PanelLabel> labels;  // of the first page's pieces
};
Labelled Label(const Board& board, double seam_allowance_mm, double page_width_mm = 400) {
  Labelled out;
  out.layout =
      LayOutBoard(board, {.page_width_mm = page_width_mm, .seam_allowance_mm = seam_allowance_mm}).value();
  EXPECT_EQ(out.layout.pages.size(), 1u);
  for (const PrintPiece& piece : out.layout.pages[0].pieces)
    out.labels.push_back(PlacePanelLabel(piece, PieceCells(board, piece, out.layout.allowance_cells), 2.7));
  return out;
}

// The least and the largest of PieceCells under the label.
struct Under {
  int least = 2, most = 0;
};
Under CellsUnder(const Board& board, const Labelled& print, const PanelLabel& label,
                 const PrintPiece& piece) {
  const std::vector<uint8_t> cells = PieceCells(board, piece, print.layout.allowance_cells);
  Under out;
  for (double x = label.low_mm.x(); x <= label.high_mm.x(); x += 0.1) {
    for (double y = label.low_mm.y(); y <= label.high_mm.y(); y += 0.1) {
      const int row = static_cast<int>(std::floor((y - piece.y_mm) / 2.7)),
                col = static_cast<int>(std::floor((x - piece.x_mm) / 2.7));
      const bool outside = row < 0 || col < 0 || row >= piece.rows || col >= piece.cols;
      const int cell = outside ? 0 : cells[static_cast<size_t>(row) * piece.cols + col];
      out.least = std::min(out.least, cell);
      out.most = std::max(out.most, cell);
    }
  }
  return out;
}

TEST(PanelLabel, StandsInTheSeamAllowanceOfItsPanel) {
  const Board board = BoardOfPanels();
  const Labelled print = Label(board, 10);
  ASSERT_EQ(print.labels.size(), 4u);
  for (size_t i = 0; i < print.labels.size(); ++i) {
    const PanelLabel& label = print.labels[i];
    const PrintPiece& piece = print.layout.pages[0].pieces[i];
    EXPECT_EQ(label.text, "panel " + std::to_string(piece.panel));
    EXPECT_FALSE(label.leader_mm) << label.text;
    EXPECT_GE(label.size_mm, 2.5);
    const Under under = CellsUnder(board, print, label, piece);
    EXPECT_EQ(under.least, 1) << label.text;  // within the cut line
    EXPECT_EQ(under.most, 1) << label.text;   // beyond the seam
  }
}

TEST(PanelLabel, StandsBesideAPanelWithoutRoomAndALineLeadsThere) {
  const Board board = BoardOfPanels();
  for (const double allowance_mm : {0.0, 2.0, 10.0}) {
    const Labelled print = Label(board, allowance_mm);
    const std::vector<PrintPiece>& pieces = print.layout.pages[0].pieces;
    for (size_t i = 0; i < pieces.size(); ++i) {
      const PanelLabel& label = print.labels[i];
      if (!label.leader_mm) continue;
      EXPECT_GE(label.size_mm, 2);
      // On no piece, its own included, within the page, the line shorter than the gap unless the piece's
      // lower border is far from the label.
      for (const PrintPiece& piece : pieces)
        EXPECT_EQ(CellsUnder(board, print, label, piece).most, 0) << label.text << " on " << piece.label;
      EXPECT_LT(label.high_mm.x(), print.layout.pages[0].width_mm);
      EXPECT_LT(label.high_mm.y(), print.layout.pages[0].height_mm);
      const Eigen::Vector2d from((label.low_mm.x() + label.high_mm.x()) / 2, label.low_mm.y());
      EXPECT_LT((*label.leader_mm - from).norm(), 15);
      PanelLabel point = label;  // the line's end touches its own panel
      point.low_mm = *label.leader_mm - Eigen::Vector2d(0.3, 0.3);
      point.high_mm = *label.leader_mm + Eigen::Vector2d(0.3, 0.3);
      EXPECT_GT(CellsUnder(board, print, point, pieces[i]).most, 0);
    }
    const auto beside = std::count_if(print.labels.begin(), print.labels.end(),
                                      [](const PanelLabel& label) { return label.leader_mm.has_value(); });
    EXPECT_EQ(beside, allowance_mm < 5 ? 4 : 0) << allowance_mm;
  }
}

TEST(PanelLabel, LabelsOfNeighboursDoNotMeet) {
  Board board = *GenerateBoard(40, 100, 2.7, 1);
  board.panels.assign(40 * 100, 0);
  for (int i = 0; i < 20; ++i)  // single cells, as narrow as a piece can be
    board.panels[static_cast<size_t>(100) * 3 + 4 * i] = 100 + i;
  const Labelled print = Label(board, 0, 330);
  for (size_t i = 0; i < print.labels.size(); ++i) {
    for (size_t k = 0; k < i; ++k) {
      const PanelLabel &a = print.labels[i], &b = print.labels[k];
      const bool apart =
          (a.low_mm.array() > b.high_mm.array()).any() || (b.low_mm.array() > a.high_mm.array()).any();
      EXPECT_TRUE(apart) << a.text << " and " << b.text;
    }
  }
}

}  // namespace
}  // namespace weft
