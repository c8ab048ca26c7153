#include "capture/calibration/side_bows.h"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <array>
#include <optional>

#include "capture/calibration/edge_lines.h"

namespace weft {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

// The line through the side's steps, as far from its chord as least squares over the part that is looked at
// make it where the side is a parabola.
struct FittedSide {
  Eigen::Vector2d normal;
  double offset_px = 0;
};
FittedSide FitSide(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Eigen::Vector2d& middle) {
  const Eigen::Vector2d along = to - from;
  const double length_px = along.norm(), looked_at = 1 - 2 * kCornerShare;
  FittedSide side;
  side.normal = Eigen::Vector2d(along.y(), -along.x()) / length_px;
  if (length_px <= kBendsFromPx)
    side.offset_px = (1 - looked_at * looked_at / 3) * side.normal.dot(middle - (from + to) / 2);
  return side;
}

// Found minus true corners of a tag.
std::optional<Corners> BowsOf(const CameraModel& camera, const TagBoard& board, const BoardWarp& warp,
                              const RigidPose& world_from_board, int tag) {
  Corners corners, middles;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d at = FlatCorner(board, 4 * tag + k).head<2>(),
                          next = FlatCorner(board, 4 * tag + (k + 1) % 4).head<2>();
    const auto corner = camera.Project(world_from_board * WarpedPoint(board, warp, at)),
               middle = camera.Project(world_from_board * WarpedPoint(board, warp, (at + next) / 2));
    if (!corner || !middle) return std::nullopt;
    corners[k] = *corner;
    middles[k] = *middle;
  }
  std::array<FittedSide, 4> sides;
  for (int k = 0; k < 4; ++k) sides[k] = FitSide(corners[k], corners[(k + 1) % 4], middles[k]);
  Corners out;
  for (int k = 0; k < 4; ++k) {
    const FittedSide &before = sides[(k + 3) % 4], &after = sides[k];
    Eigen::Matrix2d normals;
    normals << before.normal.transpose(), after.normal.transpose();
    if (!(std::abs(normals.determinant()) > 0.1)) return std::nullopt;
    out[k] = normals.inverse() * Eigen::Vector2d(before.offset_px, after.offset_px);
  }
  return out;
}

}  // namespace

void CorrectSideBows(CalibrationBundle* bundle) {
  tbb::parallel_for(size_t{0}, bundle->views.size(), [&](size_t v) {
    BundleView& view = bundle->views[v];
    if (!view.straight_sides) return;
    const BoardPlacement& placement = bundle->placements[view.placement];
    int tag = -1;
    Corners bows;
    for (BoardCorner& corner : view.corners) {
      if (corner.index / 4 != tag) {
        tag = corner.index / 4;
        const std::optional<Corners> found =
            BowsOf(bundle->cameras[view.camera], bundle->boards[placement.board],
                   bundle->warps[placement.board], placement.world_from_board, tag);
        bows = found.value_or(Corners{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(),
                                      Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
      }
      const Eigen::Vector2d& bow = bows[corner.index % 4];
      corner.pixel_px += corner.bow_px - bow;
      corner.bow_px = bow;
    }
  });
}

}  // namespace weft
