#include "capture/calibration/bundle_adjustment.h"

#include <ceres/ceres.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/calibration/view_equations.h"

namespace weft {
namespace {

constexpr int kRows = kViewRows + 1;

// The numbers that the solver changes, and the equations of all views at them. Ceres asks for a new point
// once; the views are then worked out together, in the caller's arena.
class Equations : public ceres::EvaluationCallback {
 public:
  Equations(const CalibrationBundle& bundle, double huber_sigmas)
      : bundle_(bundle), huber_sigmas_(huber_sigmas) {
    const auto add = [this](const auto& block) {
      unknowns_.insert(unknowns_.end(), block.begin(), block.end());
    };
    for (const CameraModel& camera : bundle.cameras) add(UnknownsOf(camera));
    for (const BoardWarp& warp : bundle.warps) add(UnknownsOf(warp));
    for (const BoardPlacement& placement : bundle.placements) add(UnknownsOf(placement.world_from_board));
    sums_.resize(bundle.views.size());
  }

  double* Camera(size_t i) { return &unknowns_[i * kCameraUnknowns]; }
  double* Warp(size_t i) { return Camera(bundle_.cameras.size()) + i * kWarpUnknowns; }
  double* Placement(size_t i) { return Warp(bundle_.warps.size()) + i * kPlacementUnknowns; }

  void PrepareForEvaluation(bool with_derivatives, bool new_point) override {
    if (!new_point && (has_factors_ || !with_derivatives)) return;
    tbb::parallel_for(size_t{0}, bundle_.views.size(), [&](size_t v) {
      const BundleView& view = bundle_.views[v];
      const BoardPlacement& placement = bundle_.placements[view.placement];
      const ViewState state{&bundle_.cameras[view.camera],    Camera(view.camera),
                            &placement.world_from_board,      Placement(view.placement),
                            &bundle_.boards[placement.board], Warp(placement.board)};
      SumView(state, view.corners, bundle_.sigma_px[view.camera], huber_sigmas_, with_derivatives, &sums_[v]);
    });
    has_factors_ = with_derivatives;
  }

  // The last residual makes up for what Huber's weights leave out of the robust cost; to the solver it is
  // constant.
  void Fill(size_t view, double* residuals, double** jacobians) const {
    std::fill(residuals, residuals + kRows, 0.0);
    if (!has_factors_) {
      residuals[0] = std::sqrt(sums_[view].robust_cost);
      return;
    }
    const auto& factor = sums_[view].factor;
    Eigen::Map<Eigen::Matrix<double, kViewRows, 1>> r(residuals);
    r = factor.col(kViewUnknowns);
    residuals[kRows - 1] = std::sqrt(std::max(0.0, sums_[view].robust_cost - r.squaredNorm()));
    if (!jacobians) return;
    const auto fill = [&]<int kCount>(double* to, int first) {
      if (!to) return;
      Eigen::Map<Eigen::Matrix<double, kRows, kCount, Eigen::RowMajor>> block(to);
      block.setZero();
      block.template topRows<kViewRows>() = factor.template middleCols<kCount>(first);
    };
    fill.template operator()<kCameraUnknowns>(jacobians[0], 0);
    fill.template operator()<kPlacementUnknowns>(jacobians[1], kCameraUnknowns);
    fill.template operator()<kWarpUnknowns>(jacobians[2], kCameraUnknowns + kPlacementUnknowns);
  }

 private:
  const CalibrationBundle& bundle_;
  const double huber_sigmas_;
  bool has_factors_ = false;
  // Cameras, warps, placements. In one piece: Ceres orders unknowns by their addresses.
  std::vector<double> unknowns_;
  std::vector<ViewSums> sums_;
};

class ViewCost : public ceres::SizedCostFunction<kRows, kCameraUnknowns, kPlacementUnknowns, kWarpUnknowns> {
 public:
  ViewCost(const Equations& equations, size_t view) : equations_(equations), view_(view) {}
  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    equations_.Fill(view_, residuals, jacobians);
    return true;
  }

 private:
  const Equations& equations_;
  const size_t view_;
};

class RadialPrior : public ceres::SizedCostFunction<3, kCameraUnknowns> {
 public:
  explicit RadialPrior(const CameraModel& camera) : weights_(RadialPriorWeights(camera)) {}
  bool Evaluate(const double* const* unknowns, double* residuals, double** jacobians) const override {
    for (int i = 0; i < 3; ++i) residuals[i] = weights_[i] * unknowns[0][kRadialUnknowns[i]];
    if (!jacobians || !jacobians[0]) return true;
    std::fill(jacobians[0], jacobians[0] + 3 * kCameraUnknowns, 0.0);
    for (int i = 0; i < 3; ++i) jacobians[0][i * kCameraUnknowns + kRadialUnknowns[i]] = weights_[i];
    return true;
  }

 private:
  const Eigen::Vector3d weights_;
};

class TellIteration : public ceres::IterationCallback {
 public:
  TellIteration(const std::function<void(int, int)>& tell, int most) : tell_(tell), most_(most) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (tell_) tell_(summary.iteration, most_);
    return ceres::SOLVER_CONTINUE;
  }

 private:
  const std::function<void(int, int)>& tell_;
  const int most_;
};

// Unknowns of a camera that stay as they are.
std::vector<int> HeldUnknowns(const BundleOptions& options, int camera) {
  std::vector<int> held;
  const auto hold = [&held](int first, int last) {
    for (int unknown = first; unknown <= last; ++unknown) held.push_back(unknown);
  };
  if (options.lens < LensFreedom::kFocalLength) hold(0, 1);
  if (options.lens < LensFreedom::kCenterAndK1) hold(2, 4);
  if (options.lens < LensFreedom::kAll) hold(5, 8);
  if (!options.free_cameras || camera == options.reference_camera) hold(9, 14);
  return held;
}

void AddBlocks(const CalibrationBundle& bundle, const BundleOptions& options, Equations& equations,
               ceres::Problem& problem, ceres::ParameterBlockOrdering& ordering) {
  for (size_t v = 0; v < bundle.views.size(); ++v) {
    const BundleView& view = bundle.views[v];
    const int board = bundle.placements[view.placement].board;
    problem.AddResidualBlock(new ViewCost(equations, v), nullptr, equations.Camera(view.camera),
                             equations.Placement(view.placement), equations.Warp(board));
    ordering.AddElementToGroup(equations.Placement(view.placement), 0);
    ordering.AddElementToGroup(equations.Camera(view.camera), 1);
    ordering.AddElementToGroup(equations.Warp(board), 1);
  }
  for (size_t c = 0; c < bundle.cameras.size(); ++c) {
    double* camera = equations.Camera(c);
    if (!problem.HasParameterBlock(camera)) continue;
    problem.AddResidualBlock(new RadialPrior(bundle.cameras[c]), nullptr, camera);
    const std::vector<int> held = HeldUnknowns(options, static_cast<int>(c));
    if (held.size() == kCameraUnknowns) {
      problem.SetParameterBlockConstant(camera);
    } else if (!held.empty()) {
      problem.SetManifold(camera, new ceres::SubsetManifold(kCameraUnknowns, held));
    }
  }
  for (size_t b = 0; b < bundle.warps.size(); ++b) {
    if (!options.free_warps && problem.HasParameterBlock(equations.Warp(b)))
      problem.SetParameterBlockConstant(equations.Warp(b));
  }
}

}  // namespace

absl::Status BundleOptions::Validate() const {
  if (!(huber_sigmas > 0)) return absl::InvalidArgumentError("huber_sigmas must be positive");
  if (max_iterations < 1) return absl::InvalidArgumentError("max_iterations must be at least 1");
  if (!(tolerance > 0)) return absl::InvalidArgumentError("tolerance must be positive");
  if (!(first_radius > 0)) return absl::InvalidArgumentError("first_radius must be positive");
  return absl::OkStatus();
}

absl::StatusOr<BundleSummary> AdjustBundle(const BundleOptions& options, CalibrationBundle* bundle,
                                           const std::function<void(int, int)>& on_iteration) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  Equations equations(*bundle, options.huber_sigmas);
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &equations;
  ceres::Problem problem(problem_options);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  AddBlocks(*bundle, options, equations, problem, *ordering);

  ceres::Solver::Options solver;
  // Cameras share boards with most of the others, so what remains of the Schur complement is dense.
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.linear_solver_ordering = ordering;
  solver.num_threads = 1;
  solver.max_num_iterations = options.max_iterations;
  solver.initial_trust_region_radius = options.first_radius;
  solver.function_tolerance = options.tolerance;
  solver.parameter_tolerance = 1e-12;
  solver.logging_type = ceres::SILENT;
  TellIteration tell(on_iteration, options.max_iterations);
  solver.callbacks.push_back(&tell);
  ceres::Solver::Summary result;
  ceres::Solve(solver, &problem, &result);
  if (!result.IsSolutionUsable()) {
    return absl::InternalError(absl::StrCat("bundle adjustment failed: ", result.message));
  }
  for (size_t c = 0; c < bundle->cameras.size(); ++c) {
    bundle->cameras[c] = CameraWith(bundle->cameras[c], equations.Camera(c));
  }
  for (size_t p = 0; p < bundle->placements.size(); ++p) {
    RigidPose& pose = bundle->placements[p].world_from_board;
    pose = PoseWith(pose, equations.Placement(p));
  }
  for (size_t b = 0; b < bundle->warps.size(); ++b) bundle->warps[b] = WarpWith(equations.Warp(b));
  return BundleSummary{result.termination_type == ceres::CONVERGENCE,
                       static_cast<int>(result.iterations.size()) - 1, result.initial_cost,
                       result.final_cost};
}

}  // namespace weft
