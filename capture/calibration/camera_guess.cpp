#include "capture/calibration/camera_guess.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "capture/calibration/board_pose.h"
#include "capture/calibration/bundle_adjustment.h"

namespace weft {
namespace {

constexpr int kSearchViews = 12, kAdjustedViews = 30, kFocalLengths = 40;
// What a wrong lens leaves; residuals beyond some multiples of it say no more than that the guess is wrong.
constexpr double kSigmaPx = 1, kWorstRmsPx = 100;

// `count` of the views, spread evenly over those with the most corners.
std::vector<const BoardView*> Spread(std::vector<const BoardView*> views, size_t count) {
  size_t most = 0;
  for (const BoardView* view : views) most = std::max(most, view->corners.size());
  std::vector<const BoardView*> large;
  for (const BoardView* view : views) {
    if (2 * view->corners.size() >= most) large.push_back(view);
  }
  std::vector<const BoardView*> out;
  const size_t n = std::min(count, large.size());
  for (size_t i = 0; i < n; ++i) out.push_back(large[i * large.size() / n]);
  return out;
}

double PoseCost(const std::vector<TagBoard>& boards, const std::vector<const BoardView*>& views,
                const CameraModel& camera) {
  double cost = 0;
  for (const BoardView* view : views) {
    const std::vector<BoardPoseGuess> poses = GuessBoardPose(boards[view->board], view->corners, camera);
    cost += std::pow(poses.empty() ? kWorstRmsPx : std::min(kWorstRmsPx, poses[0].rms_px), 2);
  }
  return cost;
}

// The camera alone with its views, poses as GuessBoardPose gives them under this lens.
CalibrationBundle AloneWith(const std::vector<TagBoard>& boards, const std::vector<const BoardView*>& views,
                            const CameraModel& camera) {
  CalibrationBundle bundle;
  bundle.boards = boards;
  bundle.warps.resize(boards.size());
  bundle.cameras = {camera};
  bundle.sigma_px = {kSigmaPx};
  for (const BoardView* view : views) {
    const std::vector<BoardPoseGuess> poses = GuessBoardPose(boards[view->board], view->corners, camera);
    if (poses.empty()) continue;
    bundle.views.push_back({0, static_cast<int>(bundle.placements.size()), view->corners});
    bundle.placements.push_back({view->frame, view->board, poses[0].camera_from_board});
  }
  return bundle;
}

}  // namespace

absl::StatusOr<CameraModel> GuessCamera(const std::vector<TagBoard>& boards, const CalibrationCamera& camera,
                                        const std::vector<const BoardView*>& views) {
  const auto refuse = [&](const std::string& why) {
    return absl::FailedPreconditionError(absl::StrCat("camera ", camera.id, ": ", why));
  };
  if (views.size() < 3) {
    return refuse(
        absl::StrCat(views.size(), " views of a board, at least 3 are needed; show it the board more often"));
  }
  CameraModel model;
  model.id = camera.id;
  model.width_px = camera.width_px;
  model.height_px = camera.height_px;
  model.cx_px = 0.5 * (camera.width_px - 1);
  model.cy_px = 0.5 * (camera.height_px - 1);
  const double size_px = std::max(camera.width_px, camera.height_px);

  const std::vector<const BoardView*> tried = Spread(views, kSearchViews);
  double best_cost = std::numeric_limits<double>::infinity(), best_focal_px = 0;
  for (int i = 0; i < kFocalLengths; ++i) {
    model.fx_px = model.fy_px = size_px * 0.3 * std::pow(50.0, i / (kFocalLengths - 1.0));
    const double cost = PoseCost(boards, tried, model);
    if (cost < best_cost) {
      best_cost = cost;
      best_focal_px = model.fx_px;
    }
  }
  if (!(best_cost < kWorstRmsPx * kWorstRmsPx * static_cast<double>(tried.size()))) {
    return refuse(
        "no focal length explains what it sees of the boards; does target.json describe the boards that were "
        "printed?");
  }
  model.fx_px = model.fy_px = best_focal_px;
  const std::vector<const BoardView*> adjusted = Spread(views, kAdjustedViews);
  for (const LensFreedom lens :
       {LensFreedom::kFocalLength, LensFreedom::kCenterAndK1, LensFreedom::kCenterAndK1}) {
    CalibrationBundle alone = AloneWith(boards, adjusted, model);
    BundleOptions options;
    options.lens = lens;
    options.free_warps = false;
    options.tolerance = 1e-5;
    const absl::StatusOr<BundleSummary> summary = AdjustBundle(options, &alone);
    if (!summary.ok()) return refuse(std::string(summary.status().message()));
    model = alone.cameras[0];
    if (!(model.fx_px > 0.1 * size_px && model.fx_px < 100 * size_px && model.fy_px > 0.1 * size_px &&
          model.fy_px < 100 * size_px)) {
      return refuse(
          "its focal length cannot be determined, since the boards face it nearly straight; tilt the board "
          "by 30 degrees and more, in all directions");
    }
  }
  return model;
}

}  // namespace weft
