// How much of what a view shows is not the print: what its fits have to reckon with.
#pragma once

#include <vector>

#include "pattern/fit/cell.h"
#include "pattern/fit/cell_fitter.h"

namespace weft {

// Appearance::noise, in grey levels, from a view's light and the residuals of its pixels.
// What the print's model gets wrong is in proportion to the light: kModelNoise, less where `gain`
// (CellFit::gain) is small. To it the noise of pixels adds up: photons, read-out, rounding to grey levels,
// compression. It is what `residual` (CellFit::noise) exceeds the former by. A fit sees it interpolated
// between four pixels, with 4/9 of its variance in the mean.
float ModelNoise(float gain, float residual);

// The same of a view, from some of its cells. `fitter` knows the view's inks; kModelNoise where none can be
// fitted.
float ModelNoiseOf(const CellFitter& fitter, const std::vector<PredictedCell>& cells);

}  // namespace weft
