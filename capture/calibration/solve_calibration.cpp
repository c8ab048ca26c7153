#include "capture/calibration/solve_calibration.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "capture/calibration/bundle_adjustment.h"
#include "capture/calibration/camera_guess.h"
#include "capture/calibration/rig_covariance.h"
#include "capture/calibration/rig_initialization.h"
#include "capture/calibration/scale_bars.h"
#include "capture/calibration/shared_views.h"
#include "capture/calibration/side_bows.h"
#include "capture/calibration/view_equations.h"

namespace weft {
namespace {

using OnProgress = std::function<void(const std::string&, double)>;

absl::StatusOr<std::vector<CameraModel>> FirstCameras(const CalibrationTarget& target,
                                                      const CalibrationViews& views,
                                                      const std::optional<Rig>& initial, int min_corners,
                                                      const OnProgress& on_progress) {
  std::vector<CameraModel> cameras(views.cameras.size());
  std::vector<absl::Status> failures(views.cameras.size());
  std::vector<std::vector<const BoardView*>> of_camera(views.cameras.size());
  for (const BoardView& view : views.boards) {
    if (static_cast<int>(view.corners.size()) >= min_corners) of_camera[view.camera].push_back(&view);
  }
  struct {
    Mutex mutex;
    size_t done ABSL_GUARDED_BY(mutex) = 0;
  } progress;
  tbb::parallel_for(size_t{0}, cameras.size(), [&](size_t c) {
    const int known = initial ? initial->IndexOf(views.cameras[c].id) : -1;
    if (known >= 0) {
      cameras[c] = initial->cameras[known];
    } else {
      absl::StatusOr<CameraModel> guess = GuessCamera(target.boards, views.cameras[c], of_camera[c]);
      if (guess.ok()) cameras[c] = *std::move(guess);
      failures[c] = guess.status();
    }
    const MutexLock lock(progress.mutex);
    if (on_progress)
      on_progress("lenses", static_cast<double>(++progress.done) / static_cast<double>(cameras.size()));
  });
  for (const absl::Status& failure : failures) {
    if (!failure.ok()) return failure;
  }
  return cameras;
}

CalibrationBundle MakeBundle(const CalibrationTarget& target, const CalibrationViews& views,
                             std::vector<CameraModel> cameras, int min_corners) {
  CalibrationBundle bundle;
  bundle.boards = target.boards;
  bundle.warps.resize(target.boards.size());
  bundle.sigma_px.assign(cameras.size(), 1.0);
  bundle.cameras = std::move(cameras);
  std::map<std::pair<int, int>, int> placement_of;
  for (const BoardView& view : views.boards) {
    if (static_cast<int>(view.corners.size()) < min_corners) continue;
    const auto [at, added] =
        placement_of.try_emplace({view.frame, view.board}, static_cast<int>(bundle.placements.size()));
    if (added) bundle.placements.push_back({view.frame, view.board, {}});
    bundle.views.push_back({view.camera, at->second, view.corners, view.straight_sides});
  }
  return bundle;
}

// Standard deviation of each camera's corners, from the median of the residuals.
void EstimateSigmas(double least_px, CalibrationBundle* bundle) {
  std::vector<std::vector<double>> sizes(bundle->cameras.size());
  for (const BundleView& view : bundle->views) {
    for (const Eigen::Vector2d& r : ViewResiduals(*bundle, view)) {
      for (const double value : {r.x(), r.y()}) {
        if (std::isfinite(value)) sizes[view.camera].push_back(std::abs(value));
      }
    }
  }
  constexpr double kNormalSigmaPerMedian = 1.4826;
  for (size_t c = 0; c < sizes.size(); ++c) {
    bundle->sigma_px[c] = std::max(least_px, kNormalSigmaPerMedian * Median(std::move(sizes[c])));
  }
}

// Leaves out corners beyond the limit, and views of which too little is left.
void RejectOutliers(double sigmas, int min_corners, CalibrationBundle* bundle, std::vector<int>* rejected,
                    RejectedViews* left_out) {
  std::vector<BundleView> kept_views;
  for (BundleView& view : bundle->views) {
    const std::vector<Eigen::Vector2d> residuals = ViewResiduals(*bundle, view);
    std::vector<BoardCorner> kept;
    for (size_t i = 0; i < residuals.size(); ++i) {
      if (residuals[i].norm() <= sigmas * bundle->sigma_px[view.camera]) kept.push_back(view.corners[i]);
    }
    const bool enough =
        static_cast<int>(kept.size()) >= min_corners && 2 * kept.size() >= view.corners.size();
    (*rejected)[view.camera] += static_cast<int>(view.corners.size() - (enough ? kept.size() : 0));
    if (!enough) {
      const BoardPlacement& placement = bundle->placements[static_cast<size_t>(view.placement)];
      (*left_out)[{placement.frame, placement.board, view.camera}] = Misfit_px(*bundle, view);
      continue;
    }
    view.corners = std::move(kept);
    kept_views.push_back(std::move(view));
  }
  bundle->views = std::move(kept_views);
  // Placements that nobody sees any more would be unknowns without equations.
  std::vector<int> new_place(bundle->placements.size(), -1);
  std::vector<BoardPlacement> placements;
  for (BundleView& view : bundle->views) {
    int& place = new_place[view.placement];
    if (place < 0) {
      place = static_cast<int>(placements.size());
      placements.push_back(bundle->placements[view.placement]);
    }
    view.placement = place;
  }
  bundle->placements = std::move(placements);
}

int CameraWithMostViews(const CalibrationBundle& bundle) {
  std::vector<int> views(bundle.cameras.size(), 0);
  for (const BundleView& view : bundle.views) ++views[view.camera];
  return static_cast<int>(std::max_element(views.begin(), views.end()) - views.begin());
}

absl::Status CheckAllCamerasLeft(const CalibrationBundle& bundle, const std::vector<int>& rejected) {
  std::vector<int> views(bundle.cameras.size(), 0);
  for (const BundleView& view : bundle.views) ++views[view.camera];
  for (size_t c = 0; c < views.size(); ++c) {
    if (views[c] > 0) continue;
    return absl::FailedPreconditionError(absl::StrCat(
        "camera ", bundle.cameras[c].id, ": none of its views fits the other cameras (", rejected[c],
        " corners rejected); was it moved while recording, or are its images those of another camera?"));
  }
  return absl::OkStatus();
}

absl::Status Adjust(const SolveOptions& options, const OnProgress& on_progress, CalibrationSolution* solution,
                    std::vector<int>* rejected, RejectedViews* left_out) {
  struct Round {
    double tolerance;
    double first_radius;
    double rejection_sigmas;  // before the round; 0 for none
  };
  // Warps are free from the start: lenses that had to make up for a bent board came back only slowly.
  const Round rounds[] = {
      {1e-3, 1e4, 0}, {1e-6, 1e7, 2 * options.rejection_sigmas}, {1e-8, 1e7, options.rejection_sigmas}};
  CalibrationBundle& bundle = solution->bundle;
  for (int i = 0; i < 3; ++i) {
    if (rounds[i].rejection_sigmas > 0) {
      CorrectSideBows(&bundle);
      EstimateSigmas(options.min_sigma_px, &bundle);
      RejectOutliers(rounds[i].rejection_sigmas, options.min_corners, &bundle, rejected, left_out);
      WEFT_RETURN_IF_ERROR(CheckAllCamerasLeft(bundle, *rejected));
      EstimateSigmas(options.min_sigma_px, &bundle);
    }
    BundleOptions bundle_options;
    bundle_options.huber_sigmas = options.huber_sigmas;
    bundle_options.tolerance = rounds[i].tolerance;
    bundle_options.first_radius = rounds[i].first_radius;
    bundle_options.max_iterations = 100;
    bundle_options.reference_camera = CameraWithMostViews(bundle);
    WEFT_ASSIGN_OR_RETURN(const BundleSummary summary,
                          AdjustBundle(bundle_options, &bundle, [&](int done, int most) {
                            if (on_progress)
                              on_progress("adjustment", (i + static_cast<double>(done) / most) / 3);
                          }));
    solution->iterations += summary.iterations;
    solution->converged = summary.converged;
  }
  return absl::OkStatus();
}

void MoveWorld(const RigidPose& new_from_old, CalibrationBundle* bundle) {
  const RigidPose old_from_new = new_from_old.Inverse();
  for (CameraModel& camera : bundle->cameras)
    SetCameraFromWorld(CameraFromWorld(camera) * old_from_new, &camera);
  for (BoardPlacement& p : bundle->placements) p.world_from_board = new_from_old * p.world_from_board;
}

absl::Status SetWorld(const CalibrationViews& views, const SolveOptions& options, CalibrationBundle* bundle) {
  std::vector<int> seen(bundle->placements.size(), 0);
  for (const BundleView& view : bundle->views) ++seen[view.placement];
  int chosen = -1;
  for (size_t p = 0; p < seen.size(); ++p) {
    const BoardPlacement& placement = bundle->placements[p];
    if (!options.world_frame.empty() && views.frames[placement.frame] != options.world_frame) continue;
    if (!options.world_board.empty() && bundle->boards[placement.board].id != options.world_board) continue;
    if (chosen < 0 || seen[p] > seen[chosen]) chosen = static_cast<int>(p);
  }
  if (chosen < 0) {
    return absl::InvalidArgumentError(absl::StrCat("no board ", options.world_board, " was seen in frame ",
                                                   options.world_frame,
                                                   "; name another frame for the world"));
  }
  RigidPose world_from_board;
  if (options.world_on_floor) world_from_board.rotation << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  MoveWorld(world_from_board * bundle->placements[chosen].world_from_board.Inverse(), bundle);
  return absl::OkStatus();
}

void ScaleWorld(double scale, CalibrationBundle* bundle) {
  for (CameraModel& camera : bundle->cameras) camera.translation_mm *= scale;
  for (BoardPlacement& p : bundle->placements) p.world_from_board.translation_mm *= scale;
  for (BoardWarp& warp : bundle->warps) {
    warp.bend_xx_mm *= scale;
    warp.bend_xy_mm *= scale;
    warp.bend_yy_mm *= scale;
  }
  for (TagBoard& board : bundle->boards) {
    board.tag_mm *= scale;
    board.gap_mm *= scale;
  }
}

// Residuals, sigmas and covariances of the finished bundle.
absl::Status Assess(const SolveOptions& options, CalibrationSolution* solution) {
  const CalibrationBundle& bundle = solution->bundle;
  double in_sigmas = 0, in_px = 0;
  size_t corners = 0;
  for (const BundleView& view : bundle.views) {
    CameraFit& fit = solution->cameras[view.camera];
    const double sigma_px = bundle.sigma_px[view.camera];
    for (const Eigen::Vector2d& r : ViewResiduals(bundle, view)) {
      const double length = r.norm() / sigma_px;
      const double loss = length > options.huber_sigmas
                              ? options.huber_sigmas * (2 * length - options.huber_sigmas)
                              : length * length;
      in_sigmas += loss;
      in_px += r.squaredNorm();
      fit.rms_px += r.squaredNorm();
    }
    ++fit.views;
    fit.corners += static_cast<int>(view.corners.size());
    corners += view.corners.size();
  }
  const double unknowns = static_cast<double>(kCameraUnknowns * bundle.cameras.size() +
                                              kPlacementUnknowns * bundle.placements.size() +
                                              kWarpUnknowns * bundle.warps.size()) -
                          6;
  const double freedom = 2.0 * static_cast<double>(corners) - unknowns;
  if (!(freedom > 0)) return absl::FailedPreconditionError("fewer corners than unknowns; record more boards");
  solution->variance_factor = in_sigmas / freedom;
  solution->rms_px = std::sqrt(in_px / (2.0 * static_cast<double>(corners)));

  const Eigen::MatrixXd covariance =
      FreeNetworkCovariance(ReduceToRig(bundle, options.huber_sigmas), solution->variance_factor);
  if (covariance.size() == 0) {
    return absl::FailedPreconditionError(
        "the views do not fix all cameras; show boards tilted, near and far, over the whole of every image");
  }
  for (size_t c = 0; c < bundle.cameras.size(); ++c) {
    CameraFit& fit = solution->cameras[c];
    fit.sigma_px = bundle.sigma_px[c];
    fit.rms_px = std::sqrt(fit.rms_px / (2.0 * fit.corners));
    fit.covariance =
        covariance.block<15, 15>(static_cast<Eigen::Index>(15 * c), static_cast<Eigen::Index>(15 * c));
  }
  return absl::OkStatus();
}

// The stage is where boards were: nine points of every placed board. (Over their box the corners of images
// that no board reached would outweigh everything that matters.)
void AssessStage(CalibrationSolution* solution) {
  const CalibrationBundle& bundle = solution->bundle;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  std::vector<Eigen::Vector3d> stage;
  for (const BoardPlacement& p : bundle.placements) {
    const TagBoard& board = bundle.boards[p.board];
    for (int i = 0; i < 9; ++i) {
      stage.push_back(p.world_from_board * Eigen::Vector3d((i % 3 - 1) * board.width_mm() / 2,
                                                           (i / 3 - 1) * board.height_mm() / 2, 0));
      low = low.cwiseMin(stage.back());
      high = high.cwiseMax(stage.back());
    }
  }
  solution->stage_low_mm = low;
  solution->stage_high_mm = high;
  for (size_t c = 0; c < bundle.cameras.size(); ++c) {
    double sum = 0;
    int seen = 0;
    for (const Eigen::Vector3d& point : stage) {
      const double sigma = ProjectionSigmaPx(bundle.cameras[c], solution->cameras[c].covariance, point);
      if (!std::isfinite(sigma)) continue;
      sum += sigma * sigma;
      ++seen;
    }
    solution->cameras[c].projection_sigma_px = std::sqrt(sum / seen);
  }
}

}  // namespace

absl::Status SolveOptions::Validate() const {
  if (min_corners < 4) return absl::InvalidArgumentError("min_corners must be at least 4");
  if (!(huber_sigmas > 0)) return absl::InvalidArgumentError("huber_sigmas must be positive");
  if (!(rejection_sigmas > huber_sigmas)) {
    return absl::InvalidArgumentError("rejection_sigmas must be above huber_sigmas");
  }
  if (!(min_sigma_px > 0)) return absl::InvalidArgumentError("min_sigma_px must be positive");
  return absl::OkStatus();
}

absl::StatusOr<CalibrationSolution> SolveCalibration(const CalibrationTarget& target,
                                                     const CalibrationViews& views,
                                                     const std::optional<Rig>& initial,
                                                     const SolveOptions& options,
                                                     const OnProgress& on_progress) {
  absl::Status status = options.Validate();
  status.Update(target.Validate());
  if (!status.ok()) return status;
  WEFT_ASSIGN_OR_RETURN(std::vector<CameraModel> cameras,
                        FirstCameras(target, views, initial, options.min_corners, on_progress));
  CalibrationSolution solution;
  solution.bundle = MakeBundle(target, views, std::move(cameras), options.min_corners);
  if (on_progress) on_progress("poses", 0);
  if (status = InitializePoses(&solution.bundle); !status.ok()) return status;
  std::vector<int> rejected(views.cameras.size(), 0);
  RejectedViews left_out;
  if (status = Adjust(options, on_progress, &solution, &rejected, &left_out); !status.ok()) return status;
  solution.shared_views = FollowSharedViews(views, options.min_corners, solution.bundle, left_out);
  solution.frames = views.frames;
  if (status = SetWorld(views, options, &solution.bundle); !status.ok()) return status;
  solution.bars = MeasureScaleBars(target, views, solution.bundle.cameras);
  if (options.scale_from_bar) {
    WEFT_ASSIGN_OR_RETURN(const double scale, ScaleFromBars(target, solution.bars));
    solution.scale = scale;
    ScaleWorld(scale, &solution.bundle);
  }
  if (on_progress) on_progress("covariance", 0);
  solution.cameras.resize(views.cameras.size());
  for (size_t c = 0; c < rejected.size(); ++c) solution.cameras[c].rejected_corners = rejected[c];
  if (status = Assess(options, &solution); !status.ok()) return status;
  AssessStage(&solution);
  return solution;
}

}  // namespace weft
