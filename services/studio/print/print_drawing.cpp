#include "services/studio/print/print_drawing.h"

#include <algorithm>

#include "absl/strings/str_format.h"
#include "services/studio/print/panel_label.h"

namespace weft {
namespace {

constexpr double kCutLineMm = 0.4;
constexpr double kSeamLineMm = 0.25;
constexpr double kMarkMm = 8;

class PageDrawing {
 public:
  PageDrawing(const Board& board, const PrintLayout& layout, cairo_t* context)
      : board_(board), layout_(layout), context_(context) {}

  void Draw(size_t number);

 private:
  void Head(size_t number);
  void ScaleBar(double x, double y, double length_mm, bool upright);
  void Piece(const PrintPiece& piece);
  void Panel(const PrintPiece& piece, const std::vector<uint8_t>& cells);
  void Label(const PanelLabel& label);
  void Cells(const PrintPiece& piece, const std::vector<uint8_t>& cells);
  // Borders between cells of at least `level` and others.
  void Outline(const PrintPiece& piece, const std::vector<uint8_t>& cells, int level);
  void RegistrationMarks(const PrintPiece& piece);
  void Cross(double x, double y);
  void Text(double x, double y, double size_mm, const std::string& text);
  void Color(CellColor color) {
    const auto rgb = CellColorRgb(color);
    cairo_set_source_rgb(context_, rgb[0] / 255.0, rgb[1] / 255.0, rgb[2] / 255.0);
  }
  void Black() { cairo_set_source_rgb(context_, 0, 0, 0); }
  void Line(double x0, double y0, double x1, double y1) {
    cairo_move_to(context_, x0, y0);
    cairo_line_to(context_, x1, y1);
  }

  const Board& board_;
  const PrintLayout& layout_;
  cairo_t* context_;
};

void PageDrawing::Text(double x, double y, double size_mm, const std::string& text) {
  Black();
  cairo_select_font_face(context_, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context_, size_mm);
  cairo_move_to(context_, x, y);
  cairo_show_text(context_, text.c_str());
}

// Ends of the bar are the ends of the length; ticks each 10 mm.
void PageDrawing::ScaleBar(double x, double y, double length_mm, bool upright) {
  cairo_save(context_);
  cairo_translate(context_, x, y);
  if (upright) cairo_rotate(context_, 1.5707963267948966);
  Black();
  for (int i = 0; 10 * i < length_mm; i += 2) {
    cairo_rectangle(context_, 10 * i, upright ? -3 : 0, std::min(10.0, length_mm - 10 * i), 3);
  }
  cairo_fill(context_);
  cairo_set_line_width(context_, 0.2);
  cairo_rectangle(context_, 0.1, (upright ? -3 : 0) + 0.1, length_mm - 0.2, 2.8);
  cairo_stroke(context_);
  cairo_restore(context_);
}

void PageDrawing::Head(size_t number) {
  const double left =
      layout_.pages[number - 1].pieces.empty() ? 15 : layout_.pages[number - 1].pieces[0].x_mm;
  const double x = std::min(left, 29.0), y = 15;
  Text(x, y + 5, 5,
       absl::StrFormat("weft board %s   %d x %d cells of %g mm   page %d of %d   print at 100 %%",
                       board_.ContentHash(), board_.rows, board_.cols, layout_.cell_mm, number,
                       layout_.pages.size()));
  // Swatches: the seven inks and the black of the lines, 20 mm each.
  for (int i = 0; i <= kCellColors; ++i) {
    if (i < kCellColors) {
      Color(static_cast<CellColor>(i));
    } else {
      Black();
    }
    cairo_rectangle(context_, x + 24 * i, y + 10, 20, 20);
    cairo_fill(context_);
    Black();
    cairo_set_line_width(context_, 0.2);
    cairo_rectangle(context_, x + 24 * i, y + 10, 20, 20);
    cairo_stroke(context_);
    Text(x + 24 * i, y + 34, 3,
         i < kCellColors ? std::string(CellColorName(static_cast<CellColor>(i))) : "line");
  }
  ScaleBar(x, y + 42, 200, false);
  Text(x, y + 50, 3.5, "200 mm: measure it on the cloth before it is cut");
  const std::vector<PrintPiece>& pieces = layout_.pages[number - 1].pieces;
  if (!pieces.empty() && pieces[0].panel > 0)
    Text(x, y + 56, 3.5, "panels: seam white dashes, cut black line");
  ScaleBar(x + 218, y + 6, 40, true);
  Text(x + 224, y + 28, 3.5, "40 mm");
}

void PageDrawing::Cells(const PrintPiece& piece, const std::vector<uint8_t>& cells) {
  const double pitch = layout_.cell_mm, line = layout_.ink_line_mm;
  const auto printed = [&](int i, int j) {
    return cells[static_cast<size_t>(i) * piece.cols + j] > 0 &&
           board_.Contains(piece.row + i, piece.col + j);
  };
  if (line > 0) {
    Black();
    for (int i = 0; i < piece.rows; ++i) {
      for (int j = 0, end; j < piece.cols; j = end + 1) {
        for (end = j; end < piece.cols && printed(i, end); ++end) {
        }
        if (end > j)
          cairo_rectangle(context_, piece.x_mm + j * pitch, piece.y_mm + i * pitch, (end - j) * pitch, pitch);
      }
    }
    cairo_fill(context_);
  }
  for (int k = 0; k < kCellColors; ++k) {
    Color(static_cast<CellColor>(k));
    for (int i = 0; i < piece.rows; ++i) {
      for (int j = 0; j < piece.cols; ++j) {
        if (!printed(i, j) || board_.at(piece.row + i, piece.col + j) != static_cast<CellColor>(k)) continue;
        cairo_rectangle(context_, piece.x_mm + j * pitch + line / 2, piece.y_mm + i * pitch + line / 2,
                        pitch - line, pitch - line);
      }
    }
    cairo_fill(context_);
  }
}

void PageDrawing::Outline(const PrintPiece& piece, const std::vector<uint8_t>& cells, int level) {
  const double pitch = layout_.cell_mm;
  const auto inside = [&](int i, int j) {
    return i >= 0 && j >= 0 && i < piece.rows && j < piece.cols &&
           cells[static_cast<size_t>(i) * piece.cols + j] >= level;
  };
  // Runs of borders, so that dashes go on from cell to cell.
  for (int i = 0; i <= piece.rows; ++i) {
    for (int j = 0; j < piece.cols; ++j) {
      const int first = j;
      while (j < piece.cols && inside(i - 1, j) != inside(i, j) && inside(i, j) == inside(i, first)) ++j;
      if (j > first)
        Line(piece.x_mm + first * pitch, piece.y_mm + i * pitch, piece.x_mm + j * pitch,
             piece.y_mm + i * pitch);
      if (j > first) --j;
    }
  }
  for (int j = 0; j <= piece.cols; ++j) {
    for (int i = 0; i < piece.rows; ++i) {
      const int first = i;
      while (i < piece.rows && inside(i, j - 1) != inside(i, j) && inside(i, j) == inside(first, j)) ++i;
      if (i > first)
        Line(piece.x_mm + j * pitch, piece.y_mm + first * pitch, piece.x_mm + j * pitch,
             piece.y_mm + i * pitch);
      if (i > first) --i;
    }
  }
}

void PageDrawing::Cross(double x, double y) {
  Line(x - kMarkMm / 2, y, x + kMarkMm / 2, y);
  Line(x, y - kMarkMm / 2, x, y + kMarkMm / 2);
  cairo_new_sub_path(context_);
  cairo_arc(context_, x, y, kMarkMm / 4, 0, 6.283185307179586);
}

// Crosses beside the tile where neighbouring tiles begin and end: they come to lie upon each other.
void PageDrawing::RegistrationMarks(const PrintPiece& piece) {
  const double pitch = layout_.cell_mm, gap = kPrintGapMm / 2;
  const double right = piece.x_mm + piece.cols * pitch, bottom = piece.y_mm + piece.rows * pitch;
  Black();
  cairo_set_line_width(context_, 0.25);
  for (const int col : piece.mark_cols) {
    const double x = piece.x_mm + (col - piece.col) * pitch;
    Cross(x, piece.y_mm - gap);
    Cross(x, bottom + gap);
  }
  for (const int row : piece.mark_rows) {
    const double y = piece.y_mm + (row - piece.row) * pitch;
    Cross(piece.x_mm - gap, y);
    Cross(right + gap, y);
  }
  cairo_stroke(context_);
}

// White under the text, so that it can be read on cells.
void PageDrawing::Label(const PanelLabel& label) {
  const Eigen::Vector2d size = label.high_mm - label.low_mm;
  if (label.leader_mm) {
    Black();
    cairo_set_line_width(context_, 0.25);
    Line(label.low_mm.x() + size.x() / 2, label.low_mm.y(), label.leader_mm->x(), label.leader_mm->y());
    cairo_stroke(context_);
  } else {
    cairo_set_source_rgb(context_, 1, 1, 1);
    cairo_rectangle(context_, label.low_mm.x(), label.low_mm.y(), size.x(), size.y());
    cairo_fill(context_);
  }
  cairo_save(context_);
  cairo_translate(context_, label.low_mm.x(), label.upright ? label.high_mm.y() : label.low_mm.y());
  if (label.upright) cairo_rotate(context_, -1.5707963267948966);
  Text(0.3 * label.size_mm, 1.05 * label.size_mm, label.size_mm, label.text);
  cairo_restore(context_);
}

// The seam: white dashes on the ink lines, where they harm nothing. The cut: a black line outside.
void PageDrawing::Panel(const PrintPiece& piece, const std::vector<uint8_t>& cells) {
  const double dash = 3;
  cairo_set_source_rgb(context_, 1, 1, 1);
  cairo_set_line_width(context_, kSeamLineMm);
  cairo_set_dash(context_, &dash, 1, 0);
  Outline(piece, cells, 2);
  cairo_stroke(context_);
  cairo_set_dash(context_, nullptr, 0, 0);
  Black();
  cairo_set_line_width(context_, kCutLineMm);
  Outline(piece, cells, 1);
  cairo_stroke(context_);
  Label(PlacePanelLabel(piece, cells, layout_.cell_mm));
}

void PageDrawing::Piece(const PrintPiece& piece) {
  const std::vector<uint8_t> cells = PieceCells(board_, piece, layout_.allowance_cells);
  Cells(piece, cells);
  RegistrationMarks(piece);
  if (piece.panel > 0) {
    Panel(piece, cells);
    return;
  }
  const double beside_marks = piece.mark_cols.empty() ? 0 : 50;
  Text(piece.x_mm + beside_marks, piece.y_mm + piece.rows * layout_.cell_mm + 5, 3.5, piece.label);
}

void PageDrawing::Draw(size_t number) {
  Head(number);
  for (const PrintPiece& piece : layout_.pages[number - 1].pieces) Piece(piece);
}

}  // namespace

void DrawPrintPage(const Board& board, const PrintLayout& layout, size_t number, cairo_t* context) {
  PageDrawing(board, layout, context).Draw(number);
}

}  // namespace weft
