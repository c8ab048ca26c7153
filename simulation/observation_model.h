// What the decoder makes of a view, from the truth alone: which cells it finds, and how far off. For training
// and statistics that need more views than can be rendered and decoded.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pattern/observation.h"
#include "simulation/view_truth.h"

namespace weft {

// What finding a visible cell depends on.
struct CellSight {
  static constexpr int kFarFromEdge = 4;

  double pitch_px = 0;
  double facing_deg = 0;
  // Cells to the nearest one on the board that is not visible: 1 beside an occlusion, a silhouette or a
  // panel's edge; kFarFromEdge and beyond counts alike.
  int edge_cells = kFarFromEdge;
};

// Of the visible centres of a view, in the order of its nodes; `at` says which node each is of.
struct SeenCells {
  std::vector<size_t> at;
  std::vector<CellSight> sight;
};
SeenCells SightsOf(const ViewTruth& view);

// Regressors of the two models below: log(pitch / 8 px) with the pitch kept within 2 to 8 px, its square,
// slant (facing / 60 degrees, squared), and whether the edge is 1, 2 or 3 cells away.
inline constexpr int kSightRegressors = 6;
std::array<double, kSightRegressors> RegressorsOf(const CellSight& sight);

// Probability that a visible cell is found where it is (logistic), and the standard deviation per axis of its
// error. Both were fitted to what this version's decoder makes of pictures of the preset `shirt-drive`; the
// source says how. Pictures of other cameras need a fit of their own: those of `quickstart` lose 12 % of the
// cells of 4 to 6 px in plain sight, these none. So do other cells: those of 12 mm bend more, and are off by
// .157 px per axis instead of .079 (validation of shirt-drive-12); seen at 70 degrees beside an outline, 61 %
// are found instead of 97. `weft evaluate --pictures` drives by pictures.
double FoundProbability(const CellSight& sight);
double ErrorSigmaPx(const CellSight& sight);

// Cell centres as the decoder would deliver them: found at random, with Gaussian errors. Confidence is that
// of right cells; wrong ones (docs/decoding-accuracy.md) and corners are left out. The same seed, view and
// truth give the same observations.
std::vector<Observation> ImitateDecoder(const ViewTruth& view, uint64_t seed);

}  // namespace weft
