// The profile of printed squares between ink lines, blurred, at the points where cells are sampled.
#pragma once

#include <vector>

namespace weft {

// A cell is sampled at 8x8 points of its own coordinates, -0.875 to 0.875 cells in steps of 0.25. In memory
// 16 samples follow each other as lanes: lane l of group m is column l % 8, row 2 m + l / 8.
inline constexpr int kCellSide = 8;
inline constexpr int kSampleLanes = 16;
inline constexpr int kSampleGroups = 4;

// Column or row coordinate of sample `k` of a side.
constexpr float CellSample(int k) { return 0.25f * static_cast<float>(k) - 0.875f; }

// Shares P of the coloured squares of the cells -2 to 2 along one axis, and their slopes. 1 on the square
// and 0 on the ink, convolved with a Gaussian. By column of the samples (u), and lane by lane for their
// rows (v).
struct alignas(64) ProfileAlongU {
  float value[5][kCellSide];
  float slope[5][kCellSide];
};
struct alignas(64) ProfileAlongV {
  float value[kSampleGroups][5][kSampleLanes];
  float slope[kSampleGroups][5][kSampleLanes];
};

// Tabulated over the blur.
class SampledProfile {
 public:
  // `square_fraction` is the coloured share of the pitch.
  explicit SampledProfile(double square_fraction);

  // Tables for a blur of `sigma` pitches (0.04 to 1.65, others are clamped).
  const ProfileAlongU& AlongU(float sigma) const { return along_u_[Level(sigma)]; }
  const ProfileAlongV& AlongV(float sigma) const { return along_v_[Level(sigma)]; }

 private:
  static int Level(float sigma);

  std::vector<ProfileAlongU> along_u_;
  std::vector<ProfileAlongV> along_v_;
};

}  // namespace weft
