// One printed cell and its neighbours, rendered under an affine frame and fitted to the image.
#pragma once

#include <array>
#include <vector>

#include "pattern/board/board.h"
#include "pattern/fit/appearance.h"
#include "pattern/fit/cell_bounds.h"
#include "pattern/fit/cell_frame.h"
#include "pattern/fit/cell_kernel.h"
#include "pattern/fit/sampled_profile.h"
#include "pattern/image/color_image.h"

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

// Grey levels by which the rendered print is typically wrong; balances the image against what is expected.
inline constexpr float kModelNoise = 8.0f;

// A sum of squares over small moves of a centre: half its second derivative (1 / px^2) and half its slope
// (1 / px) where the centre is, in units of its noise.
struct CenterPull {
  float xx = 0, xy = 0, yy = 0;
  float x = 0, y = 0;
};

// Fits cells of one board to one image, whose halvings `pyramid` holds (level k is 2^k times smaller); all
// arguments must outlive it. Thread-safe.
class CellFitter {
 public:
  CellFitter(const std::vector<ColorImage>& pyramid, const Board& board, const SampledProfile& profile,
             const Appearance& appearance);

  // Gauss-Newton from `start` on the six parameters of the frame; gain and offset of the light are
  // eliminated. The window reaches one cell to all sides and counts less towards its border. Not converged
  // where the window leaves the image or the print cannot be there; nor where the first steps leave it so
  // little explained that further ones will hardly bring it to `min_explained`. (row, col) must lie on the
  // board. `visible` (may be null) weighs the samples: 0 where something covers the print.
  CellFit Fit(int row, int col, const CellFrame& start, const NeighborWeights& weights, int iterations,
              float min_explained = -1e9f, const SampleMask* visible = nullptr) const;

  // What the image says about moves of the centre alone, in a print that is interpolated bilinearly between
  // the nine centres (cloth creased at the centres, as a mesh with a vertex per cell); the noise of `pull` is
  // kModelNoise. Where neighbours count less than fully, parts of the window that are not like the print
  // count less, too. Nothing moves, and sigma_px is not filled.
  CellFit FitCenter(int row, int col, const CellNodes& nodes, const NeighborWeights& weights,
                    CenterPull* pull) const;

 private:
  // The image of the pyramid that a cell is measured in.
  struct Level {
    PixelView image;
    float scale;
  };
  Level LevelFor(const CellFrame& frame) const;
  CellLook LookAt(int row, int col, const CellFrame& frame, float scale,
                  const NeighborWeights& weights) const;

  const std::vector<ColorImage>& pyramid_;
  const Board& board_;
  std::vector<uint8_t> labels_;  // [rows + 4][cols + 4], the inks with two cells off the board all around
  const SampledProfile& profile_;
  const Appearance& appearance_;
  const CellKernels& kernels_;
  std::array<std::array<float, 4>, kCellColors + 1> colors_;  // minus black; the last is off the board
};

}  // namespace weft
