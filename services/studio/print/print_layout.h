// Where a board's cells come to lie on the pages that are printed.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "pattern/board/board.h"

namespace weft {

struct PrintOptions {
  double page_width_mm = 1500;  // the fabric's printable width
  double page_height_mm = 0;    // 0: as long as it takes, one page
  double margin_mm = 15;        // free on all sides
  double ink_line_mm =
      -1;  // width of the lines between cells; negative: what the board's square_fraction says
  double overlap_mm = 30;         // of tiles that are next to each other, rounded up to whole cells
  double seam_allowance_mm = 10;  // around panels, rounded up to whole cells
  bool panels = true;             // panels cut apart, where the board has any; else the board as a whole

  // InvalidArgument names the field.
  absl::Status Validate() const;
};

// A rectangle of cells on a page: a tile of the board, or a panel with its seam allowance.
struct PrintPiece {
  std::string label;
  double x_mm = 0, y_mm = 0;  // upper left corner of its first cell, from the page's upper left corner
  // First cell and size. Rows and columns may reach beyond the board where a panel's allowance does.
  int row = 0, col = 0, rows = 0, cols = 0;
  int panel = 0;  // 0 for a tile
  // Columns and rows (of the board) where the next and the last tile end or begin: registration marks.
  std::vector<int> mark_rows, mark_cols;
};

struct PrintPage {
  double width_mm = 0, height_mm = 0;
  std::vector<PrintPiece> pieces;
};

struct PrintLayout {
  double cell_mm = 0;
  double ink_line_mm = 0;
  int allowance_cells = 0;
  std::vector<PrintPage> pages;
};

// Height of the strip at the head of each page: name, swatches and scale bars.
inline constexpr double kPrintHeadMm = 62;
// The head needs so much, margins included.
inline constexpr double kMinPrintWidthMm = 330;
// Free space around pieces for marks and labels.
inline constexpr double kPrintGapMm = 14;

// InvalidArgument: options; a board without cell_mm; a page too small for its head, for one cell beside the
// overlap or, with its name, for a panel.
absl::StatusOr<PrintLayout> LayOutBoard(const Board& board, const PrintOptions& options);

// Cells of a panel and of its allowance: 2 in the panel, 1 in the allowance, 0 elsewhere. [rows][cols] of the
// piece. For tiles 2 everywhere.
std::vector<uint8_t> PieceCells(const Board& board, const PrintPiece& piece, int allowance_cells);

}  // namespace weft
