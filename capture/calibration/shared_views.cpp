#include "capture/calibration/shared_views.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

#include "base/median.h"

namespace weft {
namespace {

// Right recordings have views that are off by 0.52 px (`weft rig rehearse`, 8 cameras of 640 x 512 px, tags
// of 60 mm at 1.8 m); pictures that were turned upside down from 2.5 px on, and mostly by a hundred.
constexpr double kFar_px = 1;

using Sight = std::pair<int, int>;  // frame, board

struct Placed {
  int placement = -1;
  std::map<int, size_t> kept;  // corners by camera
};

std::map<Sight, Placed> PlacedBoards(const CalibrationBundle& bundle) {
  std::map<Sight, Placed> placed;
  for (const BundleView& view : bundle.views) {
    const BoardPlacement& placement = bundle.placements[static_cast<size_t>(view.placement)];
    Placed& board = placed[{placement.frame, placement.board}];
    board.placement = view.placement;
    board.kept[view.camera] = view.corners.size();
  }
  return placed;
}

SharedViewFate FateOf(const BoardView& view, const CalibrationBundle& bundle, const Placed& board,
                      const RejectedViews& left_out) {
  SharedViewFate fate{view.camera, view.frame, false, false};
  const auto kept = board.kept.find(view.camera);
  fate.is_rejected = kept == board.kept.end() || 2 * kept->second < view.corners.size();
  if (!fate.is_rejected) return fate;
  // By the adjusted rig, where another camera still tells the board's place.
  const auto then = left_out.find({view.frame, view.board, view.camera});
  const double misfit_px =
      board.placement >= 0
          ? Misfit_px(bundle, {view.camera, board.placement, view.corners, view.straight_sides})
      : then == left_out.end() ? 0
                               : then->second;
  fate.is_far = misfit_px > kFar_px;
  return fate;
}

}  // namespace

double Misfit_px(const CalibrationBundle& bundle, const BundleView& view) {
  std::vector<double> sizes_px;
  for (const Eigen::Vector2d& r : ViewResiduals(bundle, view))
    sizes_px.push_back(r.allFinite() ? r.norm() : std::numeric_limits<double>::infinity());
  return Median(std::move(sizes_px));
}

std::vector<SharedViewFate> FollowSharedViews(const CalibrationViews& views, int min_corners,
                                              const CalibrationBundle& bundle,
                                              const RejectedViews& left_out) {
  std::map<Sight, std::vector<const BoardView*>> seen;
  for (const BoardView& view : views.boards)
    if (static_cast<int>(view.corners.size()) >= min_corners) seen[{view.frame, view.board}].push_back(&view);
  const std::map<Sight, Placed> placed = PlacedBoards(bundle);
  std::vector<SharedViewFate> fates;
  for (const auto& [sight, together] : seen) {
    if (together.size() < 2) continue;
    const auto board = placed.find(sight);
    const size_t first = fates.size();
    size_t rejected = 0, far = 0;
    for (const BoardView* view : together) {
      fates.push_back(FateOf(*view, bundle, board == placed.end() ? Placed{} : board->second, left_out));
      rejected += fates.back().is_rejected;
      far += fates.back().is_far;
    }
    for (size_t i = first; i < fates.size(); ++i) {
      fates[i].is_far |= far > 0 && 2 * far >= together.size();
      fates[i].is_rejected |= fates[i].is_far || (rejected > 0 && together.size() == 2);
    }
  }
  return fates;
}

}  // namespace weft
