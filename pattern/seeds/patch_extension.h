// Pieces of lattice that follow narrow strips of cloth.
#pragma once

#include <vector>

#include "pattern/image/color_image.h"
#include "pattern/seeds/keypoints.h"
#include "pattern/seeds/patch_search.h"

namespace weft {

// A lattice asks every cell for four neighbours opposite each other; of a strip three columns wide, the
// middle one alone may have them. From the cells of `patches` that have a frame, the patch goes on to the
// blob that lies where the next cell must be, which inherits the frame, bent by what the blob shows. Blobs
// come from `blobs`, each joins one patch at most, and larger patches (they come first) take theirs first;
// cells that are not among the blobs start nothing. Returns the patches of at least 12 cells, as strips that
// are not yet read.
std::vector<LevelPatch> ExtendPatches(const std::vector<ColorImage>& pyramid,
                                      const std::vector<LevelPatch>& patches,
                                      const std::vector<LooseBlob>& blobs);

}  // namespace weft
