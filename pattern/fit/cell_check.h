// Whether a fitted cell is taken, and why not: the one place that says so.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "pattern/fit/cell_fitter.h"

namespace weft {

// Why a board cell that was looked for was not taken.
enum class WhyMissing : uint8_t {
  kNoFit,         // no print could be fitted
  kMoved,         // the print is not where it was expected
  kNotExplained,  // the image does not look like the print
  kOtherInk,      // another ink fits better
  kTooSmall,
  kTaken,    // another cell is at that position of the image
  kUnsure,   // found, but not surely enough
  kCovered,  // something is in front of it
  kVague,    // the image does not fix its position
  kRival,    // another part of the board fits as well
};
inline constexpr int kWhyMissing = 10;
// In a few words, and as a name for files: "no_fit".
std::string_view Describe(WhyMissing why);
std::string_view NameOf(WhyMissing why);

// A cell that was looked for and not taken.
struct MissingCell {
  int row = 0;
  int col = 0;
  float x_px = 0, y_px = 0;
  WhyMissing why = WhyMissing::kNoFit;
};

// Nothing for a fit that can be taken. Whether it lies in the image is not asked.
std::optional<WhyMissing> Reject(const CellFit& fit, const FitLimits& limits);

// Standard deviation of a fitted position by the image alone, per axis, in px: CellFit::sigma_px without
// the fit's prior on the predicted position. Infinite where the image says nothing. `model_noise` is that of
// the fitter (CellFitter::noise).
float SigmaOfImage(const CellFit& fit, float model_noise);

}  // namespace weft
