// How the print looks in one view: its inks and its blur.
#pragma once

#include <array>
#include <vector>

#include "pattern/board/board.h"
#include "pattern/fit/cell.h"
#include "pattern/fit/sampled_profile.h"
#include "pattern/image/color_image.h"
#include "pattern/image/ink_model.h"

namespace weft {

// Grey levels by which the rendered print is typically wrong in a well exposed picture.
inline constexpr float kModelNoise = 8.0f;

// Colours in grey levels at full light (the light of a neighbourhood multiplies them), and the blur.
struct Appearance {
  std::array<Rgb, kCellColors> inks = {};
  Rgb black = {};
  float sigma_px = 0.8f;
  // Grey levels by which the rendered print is wrong in this view; balances the image against what is
  // expected.
  float noise = kModelNoise;
};

// A view and the print that it shows. `pyramid` as for CellFitter.
struct PrintedView {
  const std::vector<ColorImage>& pyramid;
  const Board& board;
  const SampledProfile& profile;
};

// The appearance that explains the placed cells best, over the blurs `sigmas_px` (ascending; the search ends
// where the error has risen twice). Alternates between the light of each cell's surroundings and, by least
// squares, the eight colours; the mean over the inks stays that of `start`.
Appearance CalibrateAppearance(const PrintedView& view, const std::vector<PlacedCell>& cells,
                               const std::vector<float>& sigmas_px, const Appearance& start);

// The same where neighbours may be hidden: samples on them weigh as PredictedCell::in_sight says.
Appearance CalibrateAppearance(const PrintedView& view, const std::vector<PredictedCell>& cells,
                               const std::vector<float>& sigmas_px, const Appearance& start);

}  // namespace weft
