// Simulated rigs and boards, and the comparison of a calibration with the rig that made them.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "capture/calibration/bundle_adjustment.h"
#include "capture/calibration/rig_covariance.h"
#include "capture/calibration/solve_calibration.h"
#include "simulation/board_motion.h"
#include "simulation/studio_rig.h"

namespace weft {

inline TagBoard MakeBoard(const std::string& id, int first_tag, int rows = 6, int cols = 5,
                          double tag_mm = 24) {
  TagBoard board{id, "tag36h11", rows, cols, tag_mm, tag_mm * 0.3, {}};
  for (int i = 0; i < rows * cols; ++i) board.tag_ids.push_back(first_tag + i);
  return board;
}

// A camera for single boards, with a lens that bends and a principal point off the middle.
inline CameraModel SmallCamera() {
  CameraModel camera;
  camera.id = "c";
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 800;
  camera.cx_px = 330;
  camera.cy_px = 225;
  camera.distortion = {-0.15, 0.05, 1e-3, -1e-3, 0};
  return camera;
}

struct SimulatedCalibration {
  Rig rig;
  MovedTarget moved;
  CalibrationViews views;
};

// The rig's cameras have lenses from one to `longest` times the shortest focal length, and principal points
// off the middle by up to a tenth of the picture.
inline SimulatedCalibration Simulate(int cameras, int frames, double noise_px, double longest = 2.5,
                                     const std::vector<ScaleBar>& bars = {}, uint64_t seed = 1) {
  StudioRigOptions rig_options;
  rig_options.cameras = cameras;
  if (cameras < 6) rig_options.around_deg = 100;  // fewer do not share boards all around
  rig_options.focal_spread = longest - 1;
  rig_options.principal_point_shift = 0.1;
  rig_options.distance_mm = 2000;
  rig_options.object_width_mm = 350;
  rig_options.object_height_mm = 420;
  rig_options.seed = seed;
  SimulatedCalibration out;
  out.rig = MakeStudioRig("studio", rig_options).value();
  BoardMotionOptions motion;
  motion.frames = frames;
  motion.seed = seed;
  out.moved = MoveTarget({"target", {MakeBoard("A", 0), MakeBoard("B", 100)}, bars}, out.rig, motion).value();
  BoardSightOptions sight;
  sight.noise_px = noise_px;
  sight.seed = seed;
  out.views = SeeTarget(out.moved, out.rig, sight);
  return out;
}

// The rigid motion that takes the solution's camera centres to the true ones.
inline RigidPose TrueFromSolved(const CalibrationSolution& solution, const Rig& truth) {
  const Eigen::Index count = static_cast<Eigen::Index>(truth.cameras.size());
  Eigen::Matrix3Xd from(3, count), to(3, count);
  for (Eigen::Index c = 0; c < count; ++c) {
    from.col(c) = solution.bundle.cameras[c].CenterWorld();
    to.col(c) = truth.cameras[c].CenterWorld();
  }
  const Eigen::Matrix4d motion = Eigen::umeyama(from, to, false);
  return {motion.topLeftCorner<3, 3>(), motion.topRightCorner<3, 1>()};
}

// Solved minus true, in the order of RigInformation, in the true world.
inline Eigen::VectorXd ErrorsOf(const CalibrationSolution& solution, const SimulatedCalibration& truth) {
  const RigidPose to_true = TrueFromSolved(solution, truth.rig);
  const size_t cameras = truth.rig.cameras.size(), boards = truth.moved.warps.size();
  Eigen::VectorXd out(static_cast<Eigen::Index>(15 * cameras + 4 * boards));
  for (size_t c = 0; c < cameras; ++c) {
    const CameraModel& is = solution.bundle.cameras[c];
    const CameraModel& should = truth.rig.cameras[c];
    const RigidPose pose = CameraFromWorld(is) * to_true.Inverse();
    const Eigen::AngleAxisd turn(pose.rotation * should.rotation.transpose());
    auto e = out.segment<15>(static_cast<Eigen::Index>(15 * c));
    e.head<4>() << is.fx_px - should.fx_px, is.fy_px - should.fy_px, is.cx_px - should.cx_px,
        is.cy_px - should.cy_px;
    for (int k = 0; k < 5; ++k) e[4 + k] = is.distortion[k] - should.distortion[k];
    e.segment<3>(9) = turn.angle() * turn.axis();
    e.segment<3>(12) = to_true * is.CenterWorld() - should.CenterWorld();
  }
  for (size_t b = 0; b < boards; ++b) {
    const BoardWarp& is = solution.bundle.warps[b];
    const BoardWarp& should = truth.moved.warps[b];
    out.segment<4>(static_cast<Eigen::Index>(15 * cameras + 4 * b)) << is.bend_xx_mm - should.bend_xx_mm,
        is.bend_xy_mm - should.bend_xy_mm, is.bend_yy_mm - should.bend_yy_mm, is.stretch - should.stretch;
  }
  return out;
}

// The solution's errors against what it says of them. In the frame of FreeNetworkCovariance, about the true
// world.
struct ErrorsAndSigmas {
  Eigen::VectorXd errors;
  Eigen::MatrixXd covariance;
  double chi_square = 0;  // of all cameras and warps together
  double freedom = 0;

  double per_freedom() const { return chi_square / freedom; }
  // Of the chi-square from what it should be, in its own standard deviations.
  double sigmas_off() const { return (chi_square - freedom) / std::sqrt(2 * freedom); }
  // Of some unknowns by themselves, e^T C^-1 e.
  double ChiSquareOf(Eigen::Index first, Eigen::Index count) const {
    const Eigen::VectorXd e = errors.segment(first, count);
    return e.dot(covariance.block(first, first, count, count).ldlt().solve(e));
  }
};
inline ErrorsAndSigmas Compare(const CalibrationSolution& solution, const SimulatedCalibration& truth) {
  CalibrationBundle bundle = solution.bundle;
  const RigidPose to_true = TrueFromSolved(solution, truth.rig);
  for (CameraModel& camera : bundle.cameras)
    SetCameraFromWorld(CameraFromWorld(camera) * to_true.Inverse(), &camera);
  for (BoardPlacement& p : bundle.placements) p.world_from_board = to_true * p.world_from_board;
  const RigInformation information = ReduceToRig(bundle, 3);
  ErrorsAndSigmas out;
  out.errors = ErrorsOf(solution, truth);
  const Eigen::Matrix<double, 6, 6> both = information.on_images.transpose() * information.gauge;
  out.errors -= information.gauge * both.ldlt().solve(information.on_images.transpose() * out.errors);
  out.covariance = FreeNetworkCovariance(information, solution.variance_factor);
  out.chi_square = out.errors.dot(information.matrix * out.errors) / solution.variance_factor;
  out.freedom = static_cast<double>(out.errors.size()) - 6;
  return out;
}

// The likelihood ratio of the true rig and the solution: how much the true cameras and warps, with the boards
// placed as well as they allow, raise the solution's cost. Chi-square with the freedom of ErrorsAndSigmas
// where sigmas and solution are right, also where lenses are weak: long lenses know their focal length to a
// thousandth and the ratio to the distance a hundred times better, so that their errors lie along a curve,
// and e^T C^-1 e, which takes it for a line, grows with the square of the noise.
inline double LikelihoodRatio(const CalibrationSolution& solution, const SimulatedCalibration& truth) {
  BundleOptions options;
  options.lens = LensFreedom::kNone;
  options.free_cameras = options.free_warps = false;
  CalibrationBundle at_solution = solution.bundle;
  const double least = AdjustBundle(options, &at_solution)->final_cost;
  const RigidPose to_true = TrueFromSolved(solution, truth.rig);
  CalibrationBundle at_truth = solution.bundle;
  for (BoardPlacement& p : at_truth.placements) p.world_from_board = to_true * p.world_from_board;
  at_truth.cameras = truth.rig.cameras;
  at_truth.warps = truth.moved.warps;
  return 2 * (AdjustBundle(options, &at_truth)->final_cost - least) / solution.variance_factor;
}

}  // namespace weft
