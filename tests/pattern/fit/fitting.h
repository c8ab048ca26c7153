// A fitter over a rendered photograph.
#pragma once

#include <vector>

#include "pattern/fit/cell_fitter.h"
#include "tests/pattern/fit/true_cells.h"

namespace weft {

inline constexpr NeighborWeights kAll = {1, 1, 1, 1, 1, 1, 1, 1, 1};

inline const Board& TestBoard() {
  static const Board board = *GenerateBoard(60, 60, 3, 5);
  return board;
}

// A photograph with a fitter that knows its inks and blur.
class Fitting {
 public:
  Fitting(const Photograph& photo, const Board& board) : Fitting(photo, board, Render(photo, board)) {}
  Fitting(const Photograph& photo, const Board& board, const Frame& frame)
      : photo_(photo),
        board_(board),
        pyramid_(HalvingsOf(frame, 3)),
        profile_(board.square_fraction),
        appearance_(TrueAppearance(photo)),
        fitter_(pyramid_, board_, profile_, appearance_) {}

  const CellFitter& fitter() const { return fitter_; }
  std::vector<PlacedCell> Cells(int step, double margin_cells = 2) const {
    return TrueCells(photo_, board_, margin_cells, step);
  }

 private:
  const Photograph photo_;
  const Board& board_;
  const std::vector<ColorImage> pyramid_;
  const SampledProfile profile_;
  const Appearance appearance_;
  const CellFitter fitter_;
};

}  // namespace weft
