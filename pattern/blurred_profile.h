// The profile of printed squares between ink lines, as a blurred image shows it.
#pragma once

#include <algorithm>
#include <vector>

namespace weft {

// P(d) of one coloured square over the distance d from the cell's middle in pitches: 1 inside and 0 on the
// ink, convolved with a Gaussian. Tabulated for the cell under a pixel and the ones before and after it, with
// slopes.
class BlurredProfile {
 public:
  struct Entry {
    float before, here, after, slope_before, slope_here, slope_after, unused[2];
  };

  // `square_fraction` is the coloured share of the pitch.
  explicit BlurredProfile(double square_fraction);

  // Entries over d from -0.5 to 0.5 for a blur of `sigma` pitches (0.04 to 1.65, others are clamped).
  const Entry* Row(float sigma) const;
  // Index into a row; d outside of -0.5 to 0.5 is clamped.
  static int Bin(float d) { return static_cast<int>(std::clamp(d + 0.5f, 0.0f, 1.0f) * kBins); }

 private:
  static constexpr int kLevels = 56;
  static constexpr int kBins = 64;
  static constexpr float kLeastSigma = 0.04f;
  static constexpr float kLogStep = 0.0677f;

  std::vector<Entry> entries_;  // [kLevels][kBins + 1]
};

}  // namespace weft
