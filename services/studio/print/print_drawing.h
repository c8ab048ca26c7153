// Draws pages of a board.
#pragma once

#include <cairo.h>

#include "services/studio/print/print_layout.h"

namespace weft {

// Onto a context whose unit is the mm and whose origin is the page's upper left corner. `number` counts
// from 1.
void DrawPrintPage(const Board& board, const PrintLayout& layout, size_t number, cairo_t* context);

}  // namespace weft
