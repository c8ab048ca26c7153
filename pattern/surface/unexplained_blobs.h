// Blobs that the known cells of a view do not explain: seeds of strips start from them.
#pragma once

#include <vector>

#include "pattern/seeds/patch_search.h"
#include "pattern/surface/board_state.h"

namespace weft {

// Those of `blobs` that lie in no cell of `state`, in their order.
std::vector<LooseBlob> UnexplainedBlobs(const BoardState& state, const std::vector<LooseBlob>& blobs);

}  // namespace weft
