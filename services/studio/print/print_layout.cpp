#include "services/studio/print/print_layout.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

absl::Status Bad(const std::string& what) { return absl::InvalidArgumentError(what); }

// First cell and number of cells of each tile along one axis.
struct Span {
  int first = 0, count = 0;
};
absl::StatusOr<std::vector<Span>> TileSpans(int cells, double room_mm, double cell_mm, double overlap_mm,
                                            const char* side) {
  const int fit = static_cast<int>(std::floor(room_mm / cell_mm + 1e-9));
  if (fit >= cells) return std::vector<Span>{{0, cells}};
  const int overlap = static_cast<int>(std::ceil(overlap_mm / cell_mm - 1e-9));
  if (fit <= overlap + 3) {
    return Bad(absl::StrCat("page_", side, "_mm leaves room for ", fit,
                            " cells beside margins and head; with an ", "overlap of ", overlap,
                            " cells no tile gets on; make the page larger or overlap_mm smaller"));
  }
  std::vector<Span> spans;
  for (int first = 0;; first += fit - overlap) {
    spans.push_back({first, std::min(fit, cells - first)});
    if (first + fit >= cells) return spans;
  }
}

// Borders between a span and the ones beside it.
std::vector<int> MarksOf(const std::vector<Span>& spans, size_t i) {
  std::vector<int> marks;
  if (i > 0) marks.push_back(spans[i].first), marks.push_back(spans[i - 1].first + spans[i - 1].count);
  if (i + 1 < spans.size())
    marks.push_back(spans[i + 1].first), marks.push_back(spans[i].first + spans[i].count);
  std::ranges::sort(marks);
  marks.erase(std::unique(marks.begin(), marks.end()), marks.end());
  return marks;
}

absl::Status LayOutTiles(const Board& board, const PrintOptions& options, PrintLayout* layout) {
  const double side = 2 * (options.margin_mm + kPrintGapMm);
  const double width = options.page_width_mm - side;
  const double height = options.page_height_mm > 0 ? options.page_height_mm - side - kPrintHeadMm
                                                   : board.rows * layout->cell_mm + 1;
  WEFT_ASSIGN_OR_RETURN(const auto cols,
                        TileSpans(board.cols, width, layout->cell_mm, options.overlap_mm, "width"));
  WEFT_ASSIGN_OR_RETURN(const auto rows,
                        TileSpans(board.rows, height, layout->cell_mm, options.overlap_mm, "height"));
  for (size_t i = 0; i < rows.size(); ++i) {
    for (size_t j = 0; j < cols.size(); ++j) {
      const Span r = rows[i], c = cols[j];
      PrintPiece piece{
          .label = absl::StrCat("tile ", i + 1, ".", j + 1, ": rows ", r.first, " to ", r.first + r.count - 1,
                                ", columns ", c.first, " to ", c.first + c.count - 1),
          .x_mm = options.margin_mm + kPrintGapMm,
          .y_mm = options.margin_mm + kPrintHeadMm + kPrintGapMm,
          .row = r.first,
          .col = c.first,
          .rows = r.count,
          .cols = c.count};
      piece.mark_rows = MarksOf(rows, i);
      piece.mark_cols = MarksOf(cols, j);
      const double h = piece.y_mm + r.count * layout->cell_mm + kPrintGapMm + options.margin_mm;
      const double w = std::max(piece.x_mm * 2 + c.count * layout->cell_mm, 0.0);
      layout->pages.push_back({std::min(options.page_width_mm, std::max(w, kMinPrintWidthMm)),
                               options.page_height_mm > 0 ? options.page_height_mm : h,
                               {piece}});
    }
  }
  return absl::OkStatus();
}

std::vector<PrintPiece> PanelPieces(const Board& board, int allowance) {
  struct Box {
    int top, bottom, left, right;
  };
  std::map<int, Box> boxes;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      const int panel = board.panels[static_cast<size_t>(row) * board.cols + col];
      if (panel == 0) continue;
      Box& box = boxes.try_emplace(panel, Box{row, row, col, col}).first->second;
      box.bottom = row;
      box.left = std::min(box.left, col);
      box.right = std::max(box.right, col);
    }
  }
  std::vector<PrintPiece> pieces;
  for (const auto& [panel, box] : boxes) {
    pieces.push_back({.label = absl::StrCat("panel ", panel),
                      .row = box.top - allowance,
                      .col = box.left - allowance,
                      .rows = box.bottom - box.top + 1 + 2 * allowance,
                      .cols = box.right - box.left + 1 + 2 * allowance,
                      .panel = panel});
  }
  return pieces;
}

// In shelves from the top, tall panels first.
absl::Status LayOutPanels(const Board& board, const PrintOptions& options, PrintLayout* layout) {
  std::vector<PrintPiece> pieces = PanelPieces(board, layout->allowance_cells);
  std::ranges::stable_sort(pieces, [](const PrintPiece& a, const PrintPiece& b) { return a.rows > b.rows; });
  const double left = options.margin_mm + kPrintGapMm, top = options.margin_mm + kPrintHeadMm + kPrintGapMm;
  const double right = options.page_width_mm - options.margin_mm;
  const double bottom = options.page_height_mm > 0 ? options.page_height_mm - options.margin_mm : 1e9;
  double x = left, y = top, shelf = 0;
  layout->pages.push_back({options.page_width_mm, options.page_height_mm, {}});
  for (PrintPiece& piece : pieces) {
    const double w = piece.cols * layout->cell_mm + kPrintGapMm,
                 h = piece.rows * layout->cell_mm + kPrintGapMm;
    if (left + w > right || top + h > bottom) {
      return Bad(absl::StrCat(
          "panel ", piece.panel, " with its seam allowance measures ", std::lround(w - kPrintGapMm), " x ",
          std::lround(h - kPrintGapMm),
          " mm and does not fit the page; make page_width_mm or page_height_mm larger, or print ",
          "the board in tiles"));
    }
    if (x + w > right) x = left, y += shelf, shelf = 0;
    if (y + h > bottom) {
      layout->pages.push_back({options.page_width_mm, options.page_height_mm, {}});
      x = left, y = top, shelf = 0;
    }
    piece.x_mm = x;
    piece.y_mm = y;
    x += w;
    shelf = std::max(shelf, h);
    PrintPage& page = layout->pages.back();
    page.pieces.push_back(piece);
    if (options.page_height_mm <= 0) page.height_mm = y + shelf + options.margin_mm;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status PrintOptions::Validate() const {
  if (!(page_width_mm > 0 && page_width_mm < 1e5)) return Bad("page_width_mm must lie between 0 and 100000");
  if (!(page_height_mm >= 0 && page_height_mm < 1e5)) return Bad("page_height_mm must lie in 0 to 100000");
  if (!(margin_mm >= 0)) return Bad("margin_mm must not be negative");
  if (!std::isfinite(ink_line_mm)) return Bad("ink_line_mm must be a number");
  if (!(overlap_mm >= 0)) return Bad("overlap_mm must not be negative");
  if (!(seam_allowance_mm >= 0)) return Bad("seam_allowance_mm must not be negative");
  if (page_width_mm - 2 * margin_mm < kMinPrintWidthMm - 30)
    return Bad(absl::StrCat("page_width_mm must leave ", kMinPrintWidthMm - 30,
                            " mm between the margins for the head"));
  return absl::OkStatus();
}

absl::StatusOr<PrintLayout> LayOutBoard(const Board& board, const PrintOptions& options) {
  WEFT_RETURN_IF_ERROR(board.Validate());
  WEFT_RETURN_IF_ERROR(options.Validate());
  if (!(board.cell_mm > 0))
    return Bad(absl::StrCat("board ", board.id, " has no cell_mm; give the pitch of its cells (--cell-mm)"));
  PrintLayout layout;
  layout.cell_mm = board.cell_mm;
  layout.ink_line_mm =
      options.ink_line_mm >= 0 ? options.ink_line_mm : (1 - board.square_fraction) * board.cell_mm;
  if (layout.ink_line_mm >= 0.9 * board.cell_mm)
    return Bad(absl::StrCat("ink_line_mm ", layout.ink_line_mm, " leaves nothing of cells of ", board.cell_mm,
                            " mm"));
  layout.allowance_cells = static_cast<int>(std::ceil(options.seam_allowance_mm / board.cell_mm - 1e-9));
  const bool panels = options.panels && !board.panels.empty();
  WEFT_RETURN_IF_ERROR(panels ? LayOutPanels(board, options, &layout) : LayOutTiles(board, options, &layout));
  return layout;
}

std::vector<uint8_t> PieceCells(const Board& board, const PrintPiece& piece, int allowance_cells) {
  std::vector<uint8_t> cells(static_cast<size_t>(piece.rows) * piece.cols, piece.panel == 0 ? 2 : 0);
  if (piece.panel == 0) return cells;
  const auto in_panel = [&](int row, int col) {
    return board.Contains(row, col) &&
           board.panels[static_cast<size_t>(row) * board.cols + col] == piece.panel;
  };
  for (int i = 0; i < piece.rows; ++i) {
    for (int j = 0; j < piece.cols; ++j) {
      if (!in_panel(piece.row + i, piece.col + j)) continue;
      cells[static_cast<size_t>(i) * piece.cols + j] = 2;
      for (int di = -allowance_cells; di <= allowance_cells; ++di) {
        for (int dj = -allowance_cells; dj <= allowance_cells; ++dj) {
          if (di * di + dj * dj > allowance_cells * allowance_cells) continue;
          uint8_t& cell = cells[static_cast<size_t>(i + di) * piece.cols + j + dj];
          cell = std::max<uint8_t>(cell, 1);
        }
      }
    }
  }
  return cells;
}

}  // namespace weft
