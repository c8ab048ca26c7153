#include "triangulation/group_solver.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "triangulation/consensus.h"

namespace weft {
namespace {

constexpr int kMaxRefinementRounds = 4;
// Points that go farther from where the rows are linearised have them linearised again.
constexpr double kReachMm = 1;
// A step that gains less is the last one. One of Newton's, times the squared number of inliers: with 68 of
// them residuals move by less than .05 sigma, few pass Huber's bound, and the point is off by a thousandth of
// its sigma or so; where few rays carry the point, each of them tells more. One of reweighted least squares:
// what is left may be longer than the step. Chosen on the bent sheet of benchmark_triangulate, a fifth of the
// rays wrong: before 84, 25 and 9 cameras the worst node is off by .011, .009 and .006 sigma.
constexpr double kLeastNewtonGain = 3e-5, kLeastGain = 1e-4;
// Of a round, and for the nodes of plain_path_test, which ten steps of either kind do not all bring to their
// point. Newton's method may go to and fro over the bounds of some rays; every third step is one of
// reweighted least squares, which always comes nearer.
constexpr int kMostRefinements = 20, kNewtonSteps = 2, kStepsOfTurn = 3;

// A seed of the node's own, so that neither order nor thread count matters.
uint64_t SeedOf(const BoardNode& node, uint64_t seed) {
  return seed ^ (static_cast<uint64_t>(node.kind) << 56 | static_cast<uint64_t>(node.row) << 28 |
                 static_cast<uint64_t>(node.col));
}

double SineSquared(double deg) {
  const double sine = std::sin(deg * std::numbers::pi / 180);
  return sine * sine;
}

template <typename T>
Eigen::Vector3d OfLane(const T (&components)[3][kNodeLanes], int lane) {
  return {components[0][lane], components[1][lane], components[2][lane]};
}

// Direction of a lane's ray in the world, with depth 1.
Eigen::Vector3d RayOf(const RayCamera& camera, const RayRow& row, int lane) {
  const double* r = camera.rotation;
  const double x = double{row.pixel[0][lane]} + row.to_ray[0][lane];
  const double y = double{row.pixel[1][lane]} + row.to_ray[1][lane];
  return {r[0] * x + r[3] * y + r[6], r[1] * x + r[4] * y + r[7], r[2] * x + r[5] * y + r[8]};
}

}  // namespace

GroupSolver::GroupSolver(const TriangulationOptions& options, const std::vector<RayCamera>& cameras)
    : options_(options), cameras_(cameras) {
  const ConsensusOptions& consensus = options.consensus;
  min_sine2_ = SineSquared(consensus.min_pair_angle_deg);
  min_sine2_of_two_views_ =
      SineSquared(std::max(consensus.min_pair_angle_deg, options.two_view.min_angle_deg));
  max_cosine_ = std::cos(options.refinement.min_angle_deg * std::numbers::pi / 180);
  limits_.radius_mm2 = static_cast<float>(consensus.inlier_radius_mm * consensus.inlier_radius_mm);
  limits_.max_residual_sigmas = static_cast<float>(consensus.max_residual_sigmas);
  limits_.min_residual_px = static_cast<float>(consensus.min_residual_px);
  limits_.min_sigma_px = static_cast<float>(options.refinement.min_sigma_px);
  limits_.huber_sigmas = static_cast<float>(options.refinement.huber_sigmas);
}

void GroupSolver::Solve(const RayGroup& group, std::vector<NodeResult>* results) {
  group_ = &group;
  if (static_cast<int>(linear_.size()) < group.count) linear_.resize(group.count);
  for (int lane = 0; lane < kNodeLanes; ++lane) Start(lane);
  FindPoints();
  RefinePoints();
  for (int lane = 0; lane < kNodeLanes; ++lane)
    if (group.rays[lane] > 0) results->push_back(lanes_[lane].result);
}

void GroupSolver::Start(int lane) {
  const ConsensusOptions& consensus = options_.consensus;
  const int cameras = group_->cameras[lane];
  Lane& l = lanes_[lane] = Lane{};
  SetPoint(lane, Eigen::Vector3d::Zero());
  l.result.node = group_->first_node;
  l.result.node.col += lane;
  l.result.views = cameras;
  l.is_pair = cameras == 2 && consensus.min_views > 2 && options_.two_view.accept;
  l.min_views = l.is_pair ? 2 : consensus.min_views;
  if (cameras < l.min_views) return;
  l.stage = Lane::Stage::kSearch;
  l.result.reason = RejectReason::kNoConsensus;
  l.min_sine2 = l.is_pair ? min_sine2_of_two_views_ : min_sine2_;
  l.random = Random(SeedOf(l.result.node, consensus.seed));
  l.draws = kMaxHypotheses;
}

// RANSAC over pairs of rays as FindConsensus does it, all nodes a hypothesis at a time.
void GroupSolver::FindPoints() {
  for (;;) {
    bool searching = false;
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      Lane& l = lanes_[lane];
      enough_[lane] = 0;
      if (l.stage != Lane::Stage::kSearch) continue;
      enough_[lane] = CamerasToEndAt(lane);
      if (NextHypothesis(lane)) {
        searching = true;
      } else {
        l.stage = l.best_cameras < l.min_views ? Lane::Stage::kDone : Lane::Stage::kRefine;
      }
    }
    if (!searching) break;
    BestRayKernels().score(cameras_.data(), group_->rows.data(), group_->count,
                           PointsOf(Lane::Stage::kSearch), limits_.radius_mm2, enough_, &score_);
    for (int lane = 0; lane < kNodeLanes; ++lane)
      if (lanes_[lane].stage == Lane::Stage::kSearch) Assess(lane);
  }
}

// Moves the point of a node to the next pair of rays that meet; false where the search is over.
bool GroupSolver::NextHypothesis(int lane) {
  Lane& l = lanes_[lane];
  const int rays = group_->rays[lane], cameras = group_->cameras[lane];
  const auto try_pair = [&](int i, int j) {
    const std::optional<Eigen::Vector3d> middle = MiddleOf(lane, i, j);
    if (middle) SetPoint(lane, *middle);
    return middle.has_value();
  };
  if (TriesAllPairs(lane)) {
    if (l.best_cameras == cameras) return false;
    while (l.i + 1 < rays) {
      if (++l.j >= rays) {
        l.j = ++l.i;
      } else if (try_pair(l.i, l.j)) {
        return true;
      }
    }
    return false;
  }
  while (l.drawn < l.draws && !IsMajority(l.best_cameras, cameras)) {
    ++l.drawn;
    const auto [i, j] = DrawPair(rays, l.random);
    if (try_pair(i, j)) return true;
  }
  return false;
}

bool GroupSolver::TriesAllPairs(int lane) const {
  const int64_t rays = group_->rays[lane];
  return rays * (rays - 1) / 2 <= kMaxHypotheses;
}

// A hypothesis with so many cameras ends the search, whatever the others say.
float GroupSolver::CamerasToEndAt(int lane) const {
  const int cameras = group_->cameras[lane];
  if (TriesAllPairs(lane)) return static_cast<float>(cameras + 1);
  return static_cast<float>(std::max(LeastMajority(cameras), lanes_[lane].min_views));
}

// The hypothesis at the node's point.
void GroupSolver::Assess(int lane) {
  Lane& l = lanes_[lane];
  const int cameras = static_cast<int>(score_.cameras[lane]);
  const float squared_mm2 = score_.squared_mm2[lane];
  if (cameras < l.best_cameras || (cameras == l.best_cameras && squared_mm2 >= l.best_squared_mm2)) return;
  if (cameras > l.best_cameras && !IsMajority(cameras, group_->cameras[lane])) {
    l.draws =
        std::min(l.draws, DrawsNeeded(double(cameras) / group_->rays[lane], kDrawConfidence, kMaxHypotheses));
  }
  l.best_cameras = cameras;
  l.best_squared_mm2 = squared_mm2;
  l.best_mm = PointOf(lane);
}

// Middle of the shortest segment between two rays. Empty for rays closer to parallel than the sine, for
// points behind a camera and for segments longer than two radii, where neither ray could be an inlier.
std::optional<Eigen::Vector3d> GroupSolver::MiddleOf(int lane, int i, int j) const {
  const RayRow &row_i = RowOf(lane, i), &row_j = RowOf(lane, j);
  if (row_i.camera == row_j.camera) return std::nullopt;
  const RayCamera &camera_i = cameras_[row_i.camera], &camera_j = cameras_[row_j.camera];
  const Eigen::Vector3d a = RayOf(camera_i, row_i, lane), b = RayOf(camera_j, row_j, lane);
  const Eigen::Vector3d from = Eigen::Map<const Eigen::Vector3d>(camera_i.origin_mm);
  const Eigen::Vector3d between = Eigen::Map<const Eigen::Vector3d>(camera_j.origin_mm) - from;
  const double aa = a.squaredNorm(), ab = a.dot(b), bb = b.squaredNorm();
  const double scaled_sine2 = aa * bb - ab * ab;
  if (!(scaled_sine2 >= lanes_[lane].min_sine2 * aa * bb)) return std::nullopt;
  const double along_a = a.dot(between), along_b = b.dot(between);
  const double s = bb * along_a - ab * along_b, t = ab * along_a - aa * along_b;
  if (!(s > 0) || !(t > 0)) return std::nullopt;
  const Eigen::Vector3d on_a = s / scaled_sine2 * a, on_b = between + t / scaled_sine2 * b;
  if ((on_b - on_a).squaredNorm() > 4 * limits_.radius_mm2) return std::nullopt;
  return from + 0.5 * (on_a + on_b);
}

// Gauss-Newton from the best hypotheses, with the rays that are within the radius there. Then the inliers are
// chosen again at the refined point, until they stay.
void GroupSolver::RefinePoints() {
  bool refining = false;
  for (int lane = 0; lane < kNodeLanes; ++lane) {
    for (float* component : {steps_.mm[0], steps_.mm[1], steps_.mm[2]}) component[lane] = 0;
    SetPoint(lane, lanes_[lane].best_mm);
    refining |= lanes_[lane].stage == Lane::Stage::kRefine;
  }
  if (!refining) return;
  StartRefining();
  for (;;) {
    if (group_->repeats) KeepBestOfCameras();
    BestRayKernels().solve(system_, &solution_);
    refining = false;
    bool moved = false;
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      if (lanes_[lane].stage != Lane::Stage::kRefine) continue;
      moved |= Step(lane);
      refining |= lanes_[lane].stage == Lane::Stage::kRefine;
    }
    if (!refining) return;
    if (moved) Linearise();
    Accumulate();
  }
}

// The first systems, and the rays that take part in them.
void GroupSolver::StartRefining() {
  limits_.checks_distance =
      BestRayKernels().start(cameras_.data(), group_->rows.data(), group_->count,
                             PointsOf(Lane::Stage::kRefine), limits_, linear_.data(), &system_);
  if (!group_->repeats) return;
  Linearise();  // inliers as `start` found them at first, whatever their residuals
  KeepBestOfCameras();
  for (int lane = 0; lane < kNodeLanes; ++lane) TakeInliers(lane);
  Accumulate();
}

// One step, or the end of a round; true where the rows have to be linearised again.
bool GroupSolver::Step(int lane) {
  Lane& l = lanes_[lane];
  if (solution_.solvable[lane] == 0) {
    l.stage = Lane::Stage::kDone;
    l.result.reason = RejectReason::kPoorGeometry;
    return false;
  }
  const auto entry = [&](int k) { return solution_.covariance_mm2[k][lane]; };
  l.refined.covariance_mm2 << entry(0), entry(1), entry(2),  //
      entry(1), entry(3), entry(4),                          //
      entry(2), entry(4), entry(5);
  l.refined.chi_square = system_.chi_square[lane];
  Eigen::Vector3d offset = StepOf(lane);
  bool end = l.refined.iterations == kMostRefinements;
  if (!end) {
    const Eigen::Vector3d gradient = OfLane(system_.gradient, lane);
    const bool newton = solution_.newton[lane] != 0 && l.refined.iterations % kStepsOfTurn < kNewtonSteps;
    const Eigen::Vector3d step =
        newton ? OfLane(solution_.newton_step_mm, lane) : l.refined.covariance_mm2 * gradient;
    offset -= step;
    ++l.refined.iterations;
    const double inliers = system_.inliers[lane];
    const double least_gain = newton ? kLeastNewtonGain * inliers * inliers : kLeastGain;
    // The first system is without Huber's weight, and knows no inliers.
    const bool is_first = l.round == 0 && l.refined.iterations == 1;
    end = !is_first && (step.squaredNorm() < kRefinedMm * kRefinedMm || step.dot(gradient) < least_gain);
  }
  l.refined.position_mm = PointOf(lane) + offset;
  // The system of the last step is that of its end, unless the steps ended by their number.
  if (end) EndRound(lane);
  const bool far = l.stage == Lane::Stage::kRefine && offset.squaredNorm() > kReachMm * kReachMm;
  if (far) {
    SetPoint(lane, l.refined.position_mm);
    offset.setZero();
  }
  for (int k = 0; k < 3; ++k) steps_.mm[k][lane] = static_cast<float>(offset[k]);
  return far;
}

void GroupSolver::EndRound(int lane) {
  Lane& l = lanes_[lane];
  l.stage = Lane::Stage::kDone;
  const Eigen::Matrix3d& covariance = l.refined.covariance_mm2;
  if (!l.refined.position_mm.allFinite()) {
    l.result.reason = RejectReason::kPoorGeometry;
  } else if (l.is_pair) {
    const TwoViewOptions& pair = options_.two_view;
    if (l.refined.chi_square > pair.max_residual_sigmas * pair.max_residual_sigmas) return;
    if (covariance.trace() > 3 * pair.max_sigma_mm * pair.max_sigma_mm) {
      l.result.reason = RejectReason::kPoorGeometry;
    } else {
      l.result.point = l.refined;
    }
  } else if (static_cast<int>(system_.inliers[lane]) < l.min_views) {
    return;
  } else if (system_.changed[lane] != 0 && ++l.round < kMaxRefinementRounds) {
    TakeInliers(lane);
    l.refined.iterations = 0;
    l.stage = Lane::Stage::kRefine;
  } else if (AnglesSuffice(lane)) {
    l.result.views = static_cast<int>(system_.inliers[lane]);
    l.result.point = l.refined;
  } else {
    l.result.views = static_cast<int>(system_.inliers[lane]);
    l.result.reason = RejectReason::kPoorGeometry;
  }
}

// Whether two inliers see the point from directions far enough apart.
bool GroupSolver::AnglesSuffice(int lane) const {
  const auto towards = [&](int row) -> Eigen::Vector3d {
    return lanes_[lane].refined.position_mm -
           Eigen::Map<const Eigen::Vector3d>(cameras_[group_->rows[row].camera].origin_mm);
  };
  for (int i = 0; i < group_->count; ++i) {
    if (linear_[i].inlier[lane] == 0) continue;
    const Eigen::Vector3d a = towards(i);
    for (int j = group_->count - 1; j > i; --j) {
      if (linear_[j].inlier[lane] == 0) continue;
      const Eigen::Vector3d b = towards(j);
      if (a.dot(b) <= max_cosine_ * std::sqrt(a.squaredNorm() * b.squaredNorm())) return true;
    }
  }
  return false;
}

// Takes the flags of inliers from all rays of a camera but the one of smallest residual, and counts again.
void GroupSolver::KeepBestOfCameras() {
  std::fill(system_.inliers, system_.inliers + kNodeLanes, 0.0f);
  std::fill(system_.changed, system_.changed + kNodeLanes, 0);
  for (int lane = 0; lane < kNodeLanes; ++lane) {
    const Eigen::Vector3f step = StepOf(lane).cast<float>();
    float* best = nullptr;
    float best_px2 = 0;
    for (int i = 0; i < group_->count; ++i) {
      LinearRow& row = linear_[i];
      if (!group_->rows[i].repeated) best = nullptr;
      float* const inlier = &row.inlier[lane];
      if (*inlier == 0) continue;
      float residual_px2 = 0;
      for (int axis = 0; axis < 2; ++axis) {
        float residual_px = row.residual_px[axis][lane];
        for (int k = 0; k < 3; ++k) residual_px += row.jacobian[axis][k][lane] * step[k];
        residual_px2 += residual_px * residual_px;
      }
      if (best != nullptr) *(residual_px2 < best_px2 ? best : inlier) = 0;
      if (best != nullptr && residual_px2 >= best_px2) continue;
      best = inlier;
      best_px2 = residual_px2;
    }
    for (int i = 0; i < group_->count; ++i) {
      system_.inliers[lane] += linear_[i].inlier[lane];
      system_.changed[lane] |= (linear_[i].inlier[lane] != 0) != (linear_[i].weight[lane] > 0);
    }
  }
}

// The inliers take part from now on.
void GroupSolver::TakeInliers(int lane) {
  for (int i = 0; i < group_->count; ++i) {
    LinearRow& row = linear_[i];
    row.weight[lane] = row.inlier[lane] != 0 ? row.inverse_variance[lane] : 0;
  }
}

void GroupSolver::Linearise() {
  limits_.checks_distance =
      BestRayKernels().linearise(cameras_.data(), group_->rows.data(), group_->count,
                                 PointsOf(Lane::Stage::kRefine), limits_, linear_.data());
}

// The systems of the nodes that are still refined.
void GroupSolver::Accumulate() {
  for (int lane = 0; lane < kNodeLanes; ++lane)
    steps_.wanted[lane] = lanes_[lane].stage == Lane::Stage::kRefine ? 1 : 0;
  BestRayKernels().accumulate(linear_.data(), group_->count, steps_, limits_, &system_);
}

// The points, anchored at the first lane in a stage.
const RayPoints& GroupSolver::PointsOf(Lane::Stage stage) {
  const auto is_in = [stage](const Lane& l) { return l.stage == stage; };
  points_.anchor = static_cast<int>(std::find_if(lanes_, lanes_ + kNodeLanes - 1, is_in) - lanes_);
  return points_;
}

void GroupSolver::SetPoint(int lane, const Eigen::Vector3d& point_mm) {
  for (int k = 0; k < 3; ++k) points_.mm[k][lane] = point_mm[k];
}
Eigen::Vector3d GroupSolver::PointOf(int lane) const { return OfLane(points_.mm, lane); }
Eigen::Vector3d GroupSolver::StepOf(int lane) const { return OfLane(steps_.mm, lane); }

}  // namespace weft
