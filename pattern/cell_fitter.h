// One printed cell and its neighbours, rendered under an affine frame and fitted to the image.
#pragma once

#include <array>
#include <cstdint>

#include "pattern/appearance.h"
#include "pattern/blurred_profile.h"
#include "pattern/board.h"
#include "pattern/cell_frame.h"
#include "pattern/color_image.h"

namespace weft {

// Weight of each cell of the 3x3 neighbourhood in a fit, row by row; the middle is the cell itself.
using NeighborWeights = std::array<float, 9>;

struct CellFit {
  CellFrame frame;
  bool converged = false;
  float moved_cells = 0;  // distance from the initial position, in cells
  float explained = 0;    // share of the weighted variance that the model explains, at most 1
  float gain = 0;         // light
  float offset = 0;       // grey levels
  float noise = 0;        // RMS residual over the window, grey levels
  float center_contrast =
      0;               // RMS of what another ink would have changed in the cell, least over the other inks
  float ink_lead = 0;  // how much worse the next best ink fits the cell: difference of mean squared residuals
  float sigma_px = 0;  // predicted standard deviation of the position per axis
};

struct CellFitOptions {
  int iterations = 4;
  int stride = 1;      // every so many-th pixel in both directions
  float reach = 1.5f;  // half the side of the window, in cells; at most 1.5
  CellCurvature curvature;
};

// Fits cells of one board to one image; all arguments must outlive it. Thread-safe.
class CellFitter {
 public:
  CellFitter(const ColorImage& image, const Board& board, const BlurredProfile& profile,
             const Appearance& appearance)
      : image_(image), board_(board), profile_(profile), appearance_(appearance) {}

  // Gauss-Newton from `start` on the six parameters of the frame; gain and offset of the light are
  // eliminated. Not converged where the window leaves the image or the print cannot be there.
  CellFit Fit(int row, int col, const CellFrame& start, const NeighborWeights& weights,
              const CellFitOptions& options) const;

 private:
  const ColorImage& image_;
  const Board& board_;
  const BlurredProfile& profile_;
  const Appearance& appearance_;
};

}  // namespace weft
