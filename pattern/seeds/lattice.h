// Keypoints joined to pieces of a lattice, before anything is known about their colours' meaning.
#pragma once

#include <array>
#include <vector>

#include "absl/status/status.h"
#include "pattern/seeds/keypoints.h"

namespace weft {

struct LatticeOptions {
  // The longer axis is at most this much longer.
  float max_stretch = 3.5f;
  // Ink between two neighbours is darker than the darker of them by this much, as a ratio's logarithm.
  float min_ink_contrast = 0.04f;

  absl::Status Validate() const;
};

// One cell of a patch. Cell (i, j) has (i + 1, j) below and (i, j + 1) to the right in the patch's own axes,
// which are right-handed as the image's but otherwise arbitrary.
struct PatchCell {
  int i = 0;
  int j = 0;
  int keypoint = 0;
  // Edges to the next cell along j and along i, in px; zero where the cell has no frame of its own.
  float ax = 0, ay = 0, bx = 0, by = 0;

  bool has_frame() const { return ax != 0 || ay != 0; }
};

struct LatticePatch {
  std::vector<PatchCell> cells;
  int i_min = 0, i_max = 0, j_min = 0, j_max = 0;
};

// Patches of cells whose neighbourhoods agree with each other: every cell with a frame has its four
// neighbours opposite each other, ink in between, and corners darker than edges. A keypoint is in one patch
// at most.
std::vector<LatticePatch> BuildLattice(const std::vector<Keypoint>& points, const Plane& spots,
                                       const LatticeOptions& options);

}  // namespace weft
