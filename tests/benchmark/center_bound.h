// How well a cell's centre can be known from one picture, whatever the method: the Cramer-Rao bound.
#pragma once

#include <map>

#include "pattern/board/board.h"
#include "pattern/fit/appearance.h"
#include "tests/benchmark/decode_score.h"

namespace weft::testing {

// How a picture shows the print. `weft simulate` writes no blur and no noise with the truth, so both are
// measured in the picture: inks and blur by CalibrateAppearance on cells at their true places, which makes
// the spread of the ink a part of the blur; the noise as the scatter of second differences where the picture
// is plain. Noise that interpolation of a mosaic has smoothed comes out too small, and the bound with it.
struct PictureLook {
  Appearance appearance;
  double noise = 0;  // standard deviation, grey levels
};
PictureLook MeasureLook(const TrueView& view, const Board& board);

struct CenterBound {
  double noise_px = 0;  // with the picture's noise alone
  // With all that is left of the picture around the cell after the print is taken away, as if it were noise
  // that pixels do not share: texture, shading and what the blur of the ink differs from a Gaussian.
  double residual_px = 0;
};

// Standard deviation per axis that no unbiased estimate of a centre from the pixels around it falls
// below, for all cells in sight with their eight neighbours. The print is interpolated bilinearly between the
// nine true centres; its own one moves, the eight around are known. Gain and offset of the light around the
// cell are unknown, too.
// Estimates that let neighbours share their pixels, as the decoder's do, can be better.
std::map<BoardNode, CenterBound> CenterBounds(const TrueView& view, const Board& board,
                                              const PictureLook& look);

}  // namespace weft::testing
