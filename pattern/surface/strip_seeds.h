// Seeds in strips of the print that no seed reached: between folds, and where an edge curls.
#pragma once

#include <vector>

#include "pattern/board/board_index.h"
#include "pattern/image/color_image.h"
#include "pattern/image/ink_model.h"
#include "pattern/seeds/patch_search.h"
#include "pattern/surface/board_state.h"

namespace weft {

// Extends `patches` (see ExtendPatches) over the blobs that lie in no known cell, and reads what comes of
// them with the inks of the view. Returns the cells of the pieces that stand.
std::vector<PlacedCell> FindStripSeeds(const std::vector<ColorImage>& pyramid, const BoardIndex& board,
                                       const InkModel& inks, const PatchDecodeOptions& options,
                                       const BoardState& state, const std::vector<LevelPatch>& patches,
                                       const std::vector<LooseBlob>& blobs);

}  // namespace weft
