#include "pattern/surface/strip_seeds.h"

#include <algorithm>

#include "pattern/seeds/patch_extension.h"
#include "pattern/surface/occupied_positions.h"

namespace weft {

std::vector<PlacedCell> FindStripSeeds(const std::vector<ColorImage>& pyramid, const BoardIndex& board,
                                       const InkModel& inks, const PatchDecodeOptions& options,
                                       const BoardState& state, const std::vector<LevelPatch>& patches,
                                       const std::vector<LooseBlob>& blobs) {
  OccupiedPositions occupied(state.width_px(), state.height_px());
  for (const ViewCell& cell : state.cells()) occupied.Take(cell.fit.pose, cell.row, cell.col);
  std::vector<LooseBlob> unknown;
  std::copy_if(blobs.begin(), blobs.end(), std::back_inserter(unknown), [&](const LooseBlob& blob) {
    constexpr float kPoint = 1e-3f;  // px
    return !occupied.IsTaken({blob.x_px, blob.y_px, kPoint, 0, 0, kPoint});
  });
  std::vector<LevelPatch> strips = ExtendPatches(pyramid, patches, unknown);
  ReadPatches(inks, board, &strips);
  return SeedsOf(strips, board.board(), options);
}

}  // namespace weft
