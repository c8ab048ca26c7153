#include "capture/calibration/rig_refinement.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "capture/calibration/view_equations.h"

namespace weft {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr int kPose = 6;            // a turn about the camera's axes (rad), its centre (mm)
constexpr double kMovedSigmas = 2;  // of the prior, from which on a camera's say fades
using PoseBlock = std::array<double, kPose>;
using PoseDerivative = Eigen::Matrix<double, 2, kPose>;

// The camera at an unknown pose: turned from where it was.
struct PosedCamera {
  CameraModel camera;
  Eigen::Matrix3d turn_jacobian = Eigen::Matrix3d::Identity();
};

PosedCamera PosedAt(const CameraModel& old, const double* pose) {
  const TurnedRotation turned = Turn(Eigen::Map<const Eigen::Vector3d>(pose), old.rotation);
  PosedCamera out{old, turned.turn_jacobian};
  out.camera.rotation = turned.rotation;
  out.camera.translation_mm = -turned.rotation * Eigen::Map<const Eigen::Vector3d>(pose + 3);
  return out;
}

PoseDerivative ByPose(const PosedCamera& posed, const Projection& seen, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d in_camera = posed.camera.rotation * point_mm + posed.camera.translation_mm;
  Eigen::Matrix3d cross;
  cross << 0, -in_camera.z(), in_camera.y(), in_camera.z(), 0, -in_camera.x(), -in_camera.y(), in_camera.x(),
      0;
  PoseDerivative out;
  out.leftCols<3>() = -seen.d_pixel_d_world * posed.camera.rotation.transpose() * cross * posed.turn_jacobian;
  out.rightCols<3>() = -seen.d_pixel_d_world;
  return out;
}

// Poses of all cameras, made once for every point that the solver tries.
class Poses : public ceres::EvaluationCallback {
 public:
  explicit Poses(const Rig& rig) : rig_(rig), unknowns_(rig.cameras.size()), posed_(rig.cameras.size()) {
    for (size_t c = 0; c < unknowns_.size(); ++c) {
      const Eigen::Vector3d center = rig.cameras[c].CenterWorld();
      unknowns_[c] = {0, 0, 0, center.x(), center.y(), center.z()};
    }
    PrepareForEvaluation(true, true);
  }
  void PrepareForEvaluation(bool, bool new_point) override {
    if (!new_point) return;
    for (size_t c = 0; c < posed_.size(); ++c) posed_[c] = PosedAt(rig_.cameras[c], unknowns_[c].data());
  }
  double* Unknowns(size_t camera) { return unknowns_[camera].data(); }
  const PosedCamera& At(size_t camera) const { return posed_[camera]; }

 private:
  const Rig& rig_;
  std::vector<PoseBlock> unknowns_;
  std::vector<PosedCamera> posed_;
};

class SightCost : public ceres::SizedCostFunction<2, kPose, 3> {
 public:
  SightCost(const Poses& poses, const PointSight& sight) : poses_(poses), sight_(sight) {}
  bool Evaluate(double const* const* unknowns, double* residuals, double** jacobians) const override {
    const Eigen::Vector3d point(unknowns[1]);
    const PosedCamera& posed = poses_.At(sight_.camera);
    const std::optional<Projection> seen = posed.camera.ProjectWithDerivative(point);
    if (!seen) return false;
    Eigen::Map<Eigen::Vector2d>{residuals} = (seen->pixel_px - sight_.pixel_px) / sight_.sigma_px;
    if (!jacobians) return true;
    using RowMajorPose = Eigen::Matrix<double, 2, kPose, Eigen::RowMajor>;
    using RowMajorPoint = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;
    if (jacobians[0]) Eigen::Map<RowMajorPose>{jacobians[0]} = ByPose(posed, *seen, point) / sight_.sigma_px;
    if (jacobians[1]) Eigen::Map<RowMajorPoint>{jacobians[1]} = seen->d_pixel_d_world / sight_.sigma_px;
    return true;
  }

 private:
  const Poses& poses_;
  const PointSight& sight_;
};

// How far a pose is from where the camera stood.
class StillCost : public ceres::SizedCostFunction<kPose, kPose> {
 public:
  StillCost(const double* start, const PoseBlock& weights) : weights_(weights) {
    std::copy(start, start + kPose, start_.begin());
  }
  bool Evaluate(double const* const* unknowns, double* residuals, double** jacobians) const override {
    for (int i = 0; i < kPose; ++i) residuals[i] = weights_[i] * (unknowns[0][i] - start_[i]);
    if (!jacobians || !jacobians[0]) return true;
    std::fill(jacobians[0], jacobians[0] + kPose * kPose, 0.0);
    for (int i = 0; i < kPose; ++i) jacobians[0][i * kPose + i] = weights_[i];
    return true;
  }

 private:
  PoseBlock start_;
  const PoseBlock weights_;
};

PoseBlock StillWeights(const RigRefinementOptions& options) {
  const double turn = 1 / (kRadPerDeg * options.still_rotation_deg), shift = 1 / options.still_center_mm;
  return {turn, turn, turn, shift, shift, shift};
}

class Refiner {
 public:
  Refiner(const Rig& rig, const std::vector<Eigen::Vector3d>& points_mm,
          const std::vector<PointSight>& sights, const RigRefinementOptions& options)
      : rig_(rig), options_(options), poses_(rig) {
    out_.points_mm = points_mm;
    out_.corrections.resize(rig.cameras.size());
    Choose(sights);
  }

  absl::StatusOr<RefinedRig> Run() {
    size_t free = 0;
    for (const CameraCorrection& correction : out_.corrections) free += !correction.held;
    if (free < 3) {
      return absl::FailedPreconditionError(
          absl::StrCat("only ", free, " cameras have ", options_.min_sights,
                       " sights of points that others see too, at least 3 are needed; take more frames"));
    }
    Measure(&CameraCorrection::before_rms_px);
    WEFT_RETURN_IF_ERROR(Solve());
    Measure(&CameraCorrection::after_rms_px);
    MeasureMedians();
    WEFT_RETURN_IF_ERROR(Assess());
    for (size_t c = 0; c < rig_.cameras.size(); ++c) out_.cameras.push_back(poses_.At(c).camera);
    return std::move(out_);
  }

 private:
  // Sights that are not wrong, of points that three cameras see.
  void Choose(const std::vector<PointSight>& sights) {
    std::vector<int> seen(out_.points_mm.size(), 0);
    std::vector<bool> good(sights.size(), false);
    for (size_t s = 0; s < sights.size(); ++s) {
      const auto pixel = rig_.cameras[sights[s].camera].Project(out_.points_mm[sights[s].point]);
      good[s] = pixel && (*pixel - sights[s].pixel_px).norm() <= options_.max_residual_px;
      seen[sights[s].point] += good[s];
    }
    for (size_t s = 0; s < sights.size(); ++s) {
      if (!good[s] || seen[sights[s].point] < 3) continue;
      sights_.push_back(sights[s]);
      ++out_.corrections[sights[s].camera].sights;
    }
    for (CameraCorrection& correction : out_.corrections)
      correction.held = correction.sights < options_.min_sights;
  }

  void Measure(double CameraCorrection::*rms_px) {
    std::vector<double> sums(rig_.cameras.size(), 0);
    for (const PointSight& sight : sights_) {
      const auto pixel = poses_.At(sight.camera).camera.Project(out_.points_mm[sight.point]);
      if (pixel) sums[sight.camera] += (*pixel - sight.pixel_px).squaredNorm();
    }
    for (size_t c = 0; c < sums.size(); ++c) {
      CameraCorrection& correction = out_.corrections[c];
      correction.*rms_px = correction.sights > 0 ? std::sqrt(sums[c] / (2.0 * correction.sights)) : 0;
    }
  }

  void MeasureMedians() {
    std::vector<std::vector<double>> lengths_px(rig_.cameras.size()), lengths_sigmas(rig_.cameras.size());
    for (const PointSight& sight : sights_) {
      const auto pixel = poses_.At(sight.camera).camera.Project(out_.points_mm[sight.point]);
      if (!pixel) continue;
      const double length_px = (*pixel - sight.pixel_px).norm();
      lengths_px[sight.camera].push_back(length_px);
      lengths_sigmas[sight.camera].push_back(length_px / sight.sigma_px);
    }
    for (size_t c = 0; c < rig_.cameras.size(); ++c) {
      out_.corrections[c].after_median_px = Median(std::move(lengths_px[c]));
      out_.corrections[c].after_median_sigmas = Median(std::move(lengths_sigmas[c]));
    }
  }

  absl::Status Solve() {
    ceres::Problem::Options problem_options;
    problem_options.evaluation_callback = &poses_;
    ceres::Problem problem(problem_options);
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    auto* loss = new ceres::HuberLoss(options_.huber_sigmas);
    for (const PointSight& sight : sights_) {
      double* point = out_.points_mm[sight.point].data();
      problem.AddResidualBlock(new SightCost(poses_, sight), loss, poses_.Unknowns(sight.camera), point);
      ordering->AddElementToGroup(point, 0);
      ordering->AddElementToGroup(poses_.Unknowns(sight.camera), 1);
    }
    for (size_t c = 0; c < rig_.cameras.size(); ++c) {
      double* pose = poses_.Unknowns(c);
      if (out_.corrections[c].sights == 0) continue;
      if (out_.corrections[c].held) {
        problem.SetParameterBlockConstant(pose);
      } else {
        problem.AddResidualBlock(new StillCost(pose, StillWeights(options_)),
                                 new ceres::CauchyLoss(kMovedSigmas), pose);
      }
    }
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.linear_solver_ordering = ordering;
    solver.num_threads = 1;
    solver.max_num_iterations = options_.max_iterations;
    solver.function_tolerance = 1e-8;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    if (!summary.IsSolutionUsable())
      return absl::FailedPreconditionError(absl::StrCat("the rig was not refined: ", summary.message));
    out_.converged = summary.termination_type == ceres::CONVERGENCE;
    poses_.PrepareForEvaluation(true, true);
    return absl::OkStatus();
  }

  // What the sights and the prior say of the poses, points eliminated.
  Eigen::MatrixXd Information() const {
    const Eigen::Index size = static_cast<Eigen::Index>(kPose * rig_.cameras.size());
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(size, size);
    const PoseBlock weights = StillWeights(options_);
    for (Eigen::Index i = 0; i < size; ++i) out(i, i) = weights[i % kPose] * weights[i % kPose];
    std::vector<std::vector<const PointSight*>> of_point(out_.points_mm.size());
    for (const PointSight& sight : sights_) of_point[sight.point].push_back(&sight);
    for (size_t p = 0; p < of_point.size(); ++p) {
      const Eigen::Index count = static_cast<Eigen::Index>(of_point[p].size());
      Eigen::Matrix3d point = Eigen::Matrix3d::Zero();
      Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(kPose * count, 3);
      for (Eigen::Index k = 0; k < count; ++k) {
        const PointSight& sight = *of_point[p][k];
        const PosedCamera& posed = poses_.At(sight.camera);
        const auto seen = posed.camera.ProjectWithDerivative(out_.points_mm[p]);
        if (!seen) continue;
        const double length = (seen->pixel_px - sight.pixel_px).norm() / sight.sigma_px;
        const double weight = (length > options_.huber_sigmas ? options_.huber_sigmas / length : 1) /
                              (sight.sigma_px * sight.sigma_px);
        const PoseDerivative by_pose = ByPose(posed, *seen, out_.points_mm[p]);
        point += weight * seen->d_pixel_d_world.transpose() * seen->d_pixel_d_world;
        cross.middleRows<kPose>(kPose * k) = weight * by_pose.transpose() * seen->d_pixel_d_world;
        out.block<kPose, kPose>(kPose * sight.camera, kPose * sight.camera) +=
            weight * by_pose.transpose() * by_pose;
      }
      if (!(point.determinant() > 0)) continue;
      const Eigen::MatrixXd solved = cross * point.inverse();
      for (Eigen::Index a = 0; a < count; ++a) {
        for (Eigen::Index b = 0; b < count; ++b) {
          out.block<kPose, kPose>(kPose * of_point[p][a]->camera, kPose * of_point[p][b]->camera) -=
              solved.middleRows<kPose>(kPose * a) * cross.middleRows<kPose>(kPose * b).transpose();
        }
      }
    }
    return out;
  }

  absl::Status Assess() {
    const Eigen::MatrixXd information = Information();
    const Eigen::VectorXd unit = information.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::LLT<Eigen::MatrixXd> cholesky(unit.asDiagonal() * information * unit.asDiagonal());
    if (cholesky.info() != Eigen::Success)
      return absl::FailedPreconditionError("the points do not fix the cameras; take more frames");
    const Eigen::MatrixXd covariance = unit.asDiagonal() *
                                       cholesky.solve(Eigen::MatrixXd::Identity(unit.size(), unit.size())) *
                                       unit.asDiagonal();
    std::vector<double> shifts(rig_.cameras.size(), 0);
    for (const PointSight& sight : sights_) {
      const auto before = rig_.cameras[sight.camera].Project(out_.points_mm[sight.point]);
      const auto after = poses_.At(sight.camera).camera.Project(out_.points_mm[sight.point]);
      if (before && after) shifts[sight.camera] += (*before - *after).squaredNorm();
    }
    for (size_t c = 0; c < rig_.cameras.size(); ++c) {
      CameraCorrection& correction = out_.corrections[c];
      if (correction.held) continue;
      const CameraModel& now = poses_.At(c).camera;
      const Eigen::AngleAxisd turn(now.rotation * rig_.cameras[c].rotation.transpose());
      correction.rotation_deg = turn.angle() / kRadPerDeg;
      correction.center_mm = (now.CenterWorld() - rig_.cameras[c].CenterWorld()).norm();
      const Eigen::Index at = static_cast<Eigen::Index>(kPose * c);
      correction.covariance = covariance.block<kPose, kPose>(at, at);
      correction.rotation_sigma_deg =
          std::sqrt(correction.covariance.topLeftCorner<3, 3>().trace()) / kRadPerDeg;
      correction.center_sigma_mm = std::sqrt(correction.covariance.bottomRightCorner<3, 3>().trace());
      correction.shift_px = std::sqrt(shifts[c] / correction.sights);
      correction.moved = correction.shift_px > options_.moved_px;
    }
    return absl::OkStatus();
  }

  const Rig& rig_;
  const RigRefinementOptions& options_;
  Poses poses_;
  std::vector<PointSight> sights_;
  RefinedRig out_;
};

// Cameras that no pose put right; empty where they are too many.
std::vector<int> FindMisfits(const std::vector<CameraCorrection>& corrections,
                             const RigRefinementOptions& options) {
  constexpr size_t kLeastRightPerMisfit = 3;
  std::vector<double> medians;
  for (const CameraCorrection& correction : corrections)
    if (!correction.held) medians.push_back(correction.after_median_sigmas);
  const size_t judged = medians.size();
  const double usual = Median(std::move(medians));
  std::vector<int> misfits;
  for (size_t c = 0; c < corrections.size(); ++c) {
    const CameraCorrection& correction = corrections[c];
    if (!correction.held && correction.after_median_px > options.misfit_px &&
        correction.after_median_sigmas > options.misfit_ratio * usual)
      misfits.push_back(static_cast<int>(c));
  }
  if (misfits.size() * (kLeastRightPerMisfit + 1) > judged) misfits.clear();
  return misfits;
}

}  // namespace

absl::Status RigRefinementOptions::Validate() const {
  const auto bad = [](absl::string_view what) { return absl::InvalidArgumentError(what); };
  if (!(still_rotation_deg > 0)) return bad("still_rotation_deg must be positive");
  if (!(still_center_mm > 0)) return bad("still_center_mm must be positive");
  if (!(huber_sigmas > 0)) return bad("huber_sigmas must be positive");
  if (!(max_residual_px > 0)) return bad("max_residual_px must be positive");
  if (min_sights < 10) return bad("min_sights must be at least 10");
  if (!(moved_px > 0)) return bad("moved_px must be positive");
  if (!(misfit_ratio > 1)) return bad("misfit_ratio must be more than 1");
  if (!(misfit_px > 0)) return bad("misfit_px must be positive");
  if (max_iterations < 1) return bad("max_iterations must be at least 1");
  return absl::OkStatus();
}

absl::StatusOr<RefinedRig> RefineRig(const Rig& rig, const std::vector<Eigen::Vector3d>& points_mm,
                                     const std::vector<PointSight>& sights,
                                     const RigRefinementOptions& options) {
  absl::Status status = options.Validate();
  status.Update(rig.Validate());
  if (!status.ok()) return status;
  for (size_t s = 0; s < sights.size(); ++s) {
    const PointSight& sight = sights[s];
    const bool known = sight.camera >= 0 && sight.camera < static_cast<int>(rig.cameras.size()) &&
                       sight.point >= 0 && sight.point < static_cast<int>(points_mm.size());
    if (!known || !sight.pixel_px.allFinite() || !(sight.sigma_px > 0)) {
      return absl::InvalidArgumentError(absl::StrCat("sight ", s, " of camera ", sight.camera, ", point ",
                                                     sight.point, ": no such camera or point, or no sigma"));
    }
  }
  absl::StatusOr<RefinedRig> refined = Refiner(rig, points_mm, sights, options).Run();
  std::vector<PointSight> fitting = sights;
  std::map<int, CameraCorrection> misfits;
  while (refined.ok()) {
    const std::vector<int> found = FindMisfits(refined->corrections, options);
    if (found.empty()) break;
    for (const int camera : found) {
      const CameraCorrection& correction = refined->corrections[camera];
      misfits[camera] = {.sights = correction.sights,
                         .held = true,
                         .misfit = true,
                         .before_rms_px = correction.before_rms_px,
                         .after_rms_px = correction.after_rms_px,
                         .after_median_px = correction.after_median_px,
                         .after_median_sigmas = correction.after_median_sigmas};
    }
    std::erase_if(fitting, [&](const PointSight& sight) { return misfits.contains(sight.camera); });
    refined = Refiner(rig, points_mm, fitting, options).Run();
  }
  if (!refined.ok()) return refined;
  for (const auto& [camera, correction] : misfits) refined->corrections[camera] = correction;
  return refined;
}

}  // namespace weft
