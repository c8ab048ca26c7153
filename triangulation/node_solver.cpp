#include "triangulation/node_solver.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "triangulation/consensus.h"

namespace weft {
namespace {

constexpr int kMaxRefinementRounds = 4;
// The hypotheses' reference serves up to this distance; floats are too coarse farther away.
constexpr double kReferenceReachMm = 4;
// A step that lowers the cost by less is below a thousandth of a standard deviation.
constexpr double kLeastGain = 1e-6;

// A seed of the node's own, so that neither order nor thread count matters.
uint64_t SeedOf(const BoardNode& node, uint64_t seed) {
  return seed ^ (static_cast<uint64_t>(node.kind) << 56 | static_cast<uint64_t>(node.row) << 28 |
                 static_cast<uint64_t>(node.col));
}

// Of a normal matrix; empty where the rays do not fix a point.
std::optional<Eigen::Matrix3d> Inverse(const float* m) {
  constexpr double kLeastPivot = 1e-12;
  Eigen::Matrix3d matrix;
  matrix << m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5];
  const double minor = matrix(0, 0) * matrix(1, 1) - matrix(0, 1) * matrix(0, 1);
  if (!(matrix(0, 0) > kLeastPivot) || !(minor > kLeastPivot * matrix(0, 0)) ||
      !(matrix.determinant() > kLeastPivot * minor))
    return std::nullopt;
  const Eigen::Matrix3d inverse = matrix.inverse();
  return 0.5 * (inverse + inverse.transpose());
}

}  // namespace

NodeSolver::NodeSolver(const TriangulationOptions& options, const std::vector<RayCamera>& cameras)
    : options_(options), cameras_(cameras) {
  const ConsensusOptions& consensus = options.consensus;
  limits_.radius_mm2 = static_cast<float>(consensus.inlier_radius_mm * consensus.inlier_radius_mm);
  limits_.max_residual_sigmas = static_cast<float>(consensus.max_residual_sigmas);
  limits_.min_residual_px = static_cast<float>(consensus.min_residual_px);
  limits_.min_sigma_px = static_cast<float>(options.refinement.min_sigma_px);
  limits_.huber_sigmas = static_cast<float>(options.refinement.huber_sigmas);
}

// Consensus, refinement, and the choice of inliers again at the refined point until it stays.
NodeResult NodeSolver::Solve(const NodeRays& node, const RayBlock& block) {
  records_ = block.rays.data() + node.first;
  rays_ = node.count;
  has_reference_ = false;
  distinct_ = 0;
  for (int i = 0; i < rays_; ++i) distinct_ += i == 0 || CameraOf(i) != CameraOf(i - 1);
  const uint64_t seed = SeedOf(node.node, options_.consensus.seed);
  NodeResult result{.views = distinct_};
  if (distinct_ == 2 && options_.consensus.min_views > 2 && options_.two_view.accept) return SolvePair(seed);
  if (distinct_ < options_.consensus.min_views) return result;
  result.reason = RejectReason::kNoConsensus;
  if (!FindPoint(options_.consensus, seed)) return result;

  std::optional<RefinedPoint> point;
  for (int round = 0; round < kMaxRefinementRounds; ++round) {
    point = Refine(round == 0);
    if (!point) {
      result.reason = RejectReason::kPoorGeometry;
      return result;
    }
    if (Count(&LocalTile::inlier) < options_.consensus.min_views) return result;
    bool same = true;
    for (size_t t = 0; t * kRayLanes < static_cast<size_t>(rays_); ++t) {
      same &= std::equal(local_[t].member, local_[t].member + kRayLanes, local_[t].inlier);
      std::copy(local_[t].inlier, local_[t].inlier + kRayLanes, local_[t].member);
    }
    if (same) break;
  }
  result.views = Count(&LocalTile::member);
  if (AnglesSuffice()) {
    result.point = point;
  } else {
    result.reason = RejectReason::kPoorGeometry;
  }
  return result;
}

// The point of a node that two cameras saw, under stricter conditions than three need.
NodeResult NodeSolver::SolvePair(uint64_t seed) {
  NodeResult result{.views = 2};
  ConsensusOptions pair = options_.consensus;
  pair.min_views = 2;
  pair.min_pair_angle_deg = std::max(pair.min_pair_angle_deg, options_.two_view.min_angle_deg);
  if (!FindPoint(pair, seed)) return result;
  const std::optional<RefinedPoint> point = Refine(true);
  const double limit = options_.two_view.max_residual_sigmas;
  if (!point || point->chi_square > limit * limit) return result;
  if (point->covariance_mm2.trace() > 3 * options_.two_view.max_sigma_mm * options_.two_view.max_sigma_mm) {
    result.reason = RejectReason::kPoorGeometry;
    return result;
  }
  result.point = point;
  return result;
}

// Middle of the shortest segment between two rays; empty for rays closer to parallel than the sine, for
// points behind a camera and for segments longer than two radii: neither ray could be an inlier.
std::optional<Eigen::Vector3d> NodeSolver::MiddleOf(int i, int j, double min_sine2, double radius_mm) const {
  const Eigen::Vector3d a = AlongOf(i), b = AlongOf(j), from = OriginOf(i), between = OriginOf(j) - from;
  const double aa = a.squaredNorm(), ab = a.dot(b), bb = b.squaredNorm();
  const double scaled_sine2 = aa * bb - ab * ab;
  if (scaled_sine2 < min_sine2 * aa * bb) return std::nullopt;
  const double along_a = a.dot(between), along_b = b.dot(between);
  const double s = bb * along_a - ab * along_b, t = ab * along_a - aa * along_b;
  if (!(s > 0) || !(t > 0)) return std::nullopt;
  const Eigen::Vector3d on_a = s / scaled_sine2 * a, on_b = between + t / scaled_sine2 * b;
  if ((on_b - on_a).squaredNorm() > 4 * radius_mm * radius_mm) return std::nullopt;
  return from + 0.5 * (on_a + on_b);
}

void NodeSolver::MoveReference(const Eigen::Vector3d& reference_mm) {
  const size_t tiles = static_cast<size_t>(rays_ + kRayLanes - 1) / kRayLanes;
  if (local_.size() < tiles) local_.resize(tiles);
  BestRayKernels().localise(cameras_.data(), records_, rays_, reference_mm.data(), limits_, local_.data());
  reference_mm_ = reference_mm;
  has_reference_ = true;
}

// Rays within the radius, of each camera the closest.
RayScore NodeSolver::ScoreAt(const Eigen::Vector3f& point_mm, double radius_mm) const {
  const float radius_mm2 = static_cast<float>(radius_mm * radius_mm);
  if (distinct_ == rays_)
    return BestRayKernels().score(local_.data(), rays_, point_mm.data(), radius_mm2, best_.rays);
  RayScore score;
  for (int i = 0; i < rays_;) {
    float closest = radius_mm2;
    bool near = false;
    const int camera = CameraOf(i);
    for (; i < rays_ && CameraOf(i) == camera; ++i) {
      const LocalTile& tile = local_[i / kRayLanes];
      const int lane = i % kRayLanes;
      const Eigen::Vector3f along(tile.along[0][lane], tile.along[1][lane], tile.along[2][lane]);
      const Eigen::Vector3f offset =
          point_mm - Eigen::Vector3f(tile.foot_mm[0][lane], tile.foot_mm[1][lane], tile.foot_mm[2][lane]);
      const float square = (offset - along * (along.dot(offset) * tile.inverse_square[lane])).squaredNorm();
      if (square > closest) continue;
      closest = square;
      near = true;
    }
    score.rays += near;
    score.squared_mm2 += near ? closest : 0;
  }
  return score;
}

void NodeSolver::TryPair(int i, int j, double min_sine2, double radius_mm) {
  if (CameraOf(i) == CameraOf(j)) return;
  const std::optional<Eigen::Vector3d> middle = MiddleOf(i, j, min_sine2, radius_mm);
  if (!middle) return;
  if (!has_reference_) MoveReference(*middle);
  const Eigen::Vector3d point = *middle - reference_mm_;
  const RayScore score = ScoreAt(point.cast<float>(), radius_mm);
  if (score.rays < best_.rays || (score.rays == best_.rays && score.squared_mm2 >= best_.squared_mm2)) return;
  best_ = score;
  point_mm_ = point;
}

// RANSAC over pairs of rays as FindConsensus does it; leaves the best hypothesis in point_mm_.
bool NodeSolver::FindPoint(const ConsensusOptions& options, uint64_t seed) {
  const double sine = std::sin(options.min_pair_angle_deg * std::numbers::pi / 180);
  best_ = RayScore{};
  best_.squared_mm2 = 0;
  if (int64_t{rays_} * (rays_ - 1) / 2 <= options.max_hypotheses) {
    for (int i = 0; i < rays_ && best_.rays < distinct_; ++i) {
      for (int j = i + 1; j < rays_ && best_.rays < distinct_; ++j)
        TryPair(i, j, sine * sine, options.inlier_radius_mm);
    }
  } else {
    int draws = options.max_hypotheses, judged = -1;
    for (int k = 0; k < draws && !IsMajority(best_.rays, distinct_); ++k) {
      const auto [i, j] = DrawPair(rays_, &seed);
      TryPair(i, j, sine * sine, options.inlier_radius_mm);
      if (best_.rays == judged) continue;
      judged = best_.rays;
      draws = std::min(draws,
                       DrawsNeeded(double(best_.rays) / rays_, options.confidence, options.max_hypotheses));
    }
  }
  if (best_.rays < options.min_views) return false;
  if (point_mm_.squaredNorm() > kReferenceReachMm * kReferenceReachMm) {
    MoveReference(reference_mm_ + point_mm_);
    point_mm_.setZero();
  }
  return true;
}

// Clears the flag of all rays of a camera but the one of smallest residual; false where nothing was cleared.
bool NodeSolver::KeepBestOfCamera(float (LocalTile::*flag)[kRayLanes]) {
  bool cleared = false;
  int best = -1;
  for (int i = 0; i < rays_; ++i) {
    if (Of(flag, i) == 0) continue;
    if (best >= 0 && CameraOf(best) == CameraOf(i)) {
      const int worse = Of(&LocalTile::residual_px2, i) < Of(&LocalTile::residual_px2, best) ? best : i;
      (local_[worse / kRayLanes].*flag)[worse % kRayLanes] = 0;
      cleared = true;
      if (worse == i) continue;
    }
    best = i;
  }
  return cleared;
}

int NodeSolver::Count(float (LocalTile::*flag)[kRayLanes]) const {
  int count = 0;
  for (int t = 0; t * kRayLanes < rays_; ++t) {
    float sum = 0;
    for (const float f : local_[t].*flag) sum += f;
    count += static_cast<int>(sum);
  }
  return count;
}

// False where a member sees the point behind its camera.
bool NodeSolver::Linearise(bool select_by_radius, RaySystem* system) {
  const Eigen::Vector3f point = point_mm_.cast<float>();
  const auto run = [&](bool select) {
    BestRayKernels().linearise(local_.data(), rays_, point.data(), limits_, select, system);
  };
  run(select_by_radius);
  if (distinct_ < rays_) {
    if (select_by_radius && KeepBestOfCamera(&LocalTile::member)) run(false);
    KeepBestOfCamera(&LocalTile::inlier);
  }
  return system->in_front;
}

// Gauss-Newton with the members as they are, or with those that are within the radius at the start; moves
// point_mm_.
std::optional<RefinedPoint> NodeSolver::Refine(bool select_by_radius) {
  const RefinementOptions& options = options_.refinement;
  RefinedPoint out;
  // The system of the last step is that of its end, unless the steps ended by their number.
  for (bool done = false; !done;) {
    RaySystem system;
    if (!Linearise(select_by_radius && out.iterations == 0, &system)) return std::nullopt;
    const std::optional<Eigen::Matrix3d> inverse = Inverse(system.matrix);
    if (!inverse) return std::nullopt;
    out.covariance_mm2 = *inverse;
    out.chi_square = system.chi_square;
    if (out.iterations == options.max_iterations) break;
    const Eigen::Vector3d gradient = Eigen::Map<const Eigen::Vector3f>(system.gradient).cast<double>();
    const Eigen::Vector3d step = *inverse * gradient;
    point_mm_ -= step;
    ++out.iterations;
    done =
        step.squaredNorm() < options.tolerance_mm * options.tolerance_mm || step.dot(gradient) < kLeastGain;
  }
  if (!point_mm_.allFinite()) return std::nullopt;
  out.position_mm = reference_mm_ + point_mm_;
  return out;
}

// Whether two members see the point from directions far enough apart.
bool NodeSolver::AnglesSuffice() const {
  const double limit = std::cos(options_.refinement.min_angle_deg * std::numbers::pi / 180);
  for (int i = 0; i < rays_; ++i) {
    if (Of(&LocalTile::member, i) == 0) continue;
    const Eigen::Vector3d a = AlongOf(i);
    for (int j = rays_ - 1; j > i; --j) {
      if (Of(&LocalTile::member, j) == 0) continue;
      const Eigen::Vector3d b = AlongOf(j);
      if (a.dot(b) <= limit * std::sqrt(a.squaredNorm() * b.squaredNorm())) return true;
    }
  }
  return false;
}

}  // namespace weft
