#include "pattern/surface/unexplained_blobs.h"

#include <algorithm>
#include <iterator>

#include "pattern/surface/occupied_positions.h"

namespace weft {

std::vector<LooseBlob> UnexplainedBlobs(const BoardState& state, const std::vector<LooseBlob>& blobs) {
  OccupiedPositions occupied(state.width_px(), state.height_px());
  for (const ViewCell& cell : state.cells()) occupied.Take(cell.fit.pose, cell.row, cell.col);
  std::vector<LooseBlob> unexplained;
  std::copy_if(blobs.begin(), blobs.end(), std::back_inserter(unexplained), [&](const LooseBlob& blob) {
    constexpr float kPoint = 1e-3f;  // px
    return !occupied.IsTaken({blob.x_px, blob.y_px, kPoint, 0, 0, kPoint});
  });
  return unexplained;
}

}  // namespace weft
