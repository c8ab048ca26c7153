#include "triangulation/consensus.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace weft {
namespace {

// Middle of the shortest segment between two rays; empty for rays closer to parallel than the sine, for
// points behind a camera and for segments longer than max_gap_mm.
std::optional<Eigen::Vector3d> MiddleOf(const Sight& a, const Sight& b, double min_sine, double max_gap_mm) {
  const double cosine = a.direction.dot(b.direction);
  const double sine2 = 1 - cosine * cosine;
  if (sine2 < min_sine * min_sine) return std::nullopt;
  const Eigen::Vector3d between = b.origin_mm - a.origin_mm;
  const double along_a = a.direction.dot(between), along_b = b.direction.dot(between);
  const double s = (along_a - cosine * along_b) / sine2;
  const double t = (cosine * along_a - along_b) / sine2;
  if (!(s > 0) || !(t > 0)) return std::nullopt;
  const Eigen::Vector3d on_a = s * a.direction, on_b = between + t * b.direction;
  if ((on_b - on_a).squaredNorm() > max_gap_mm * max_gap_mm) return std::nullopt;
  return a.origin_mm + 0.5 * (on_a + on_b);
}

// Cameras with a ray within the radius, and the sum of the squared distances of their closest ones.
struct Score {
  int cameras = 0;
  double squared_mm2 = 0;
  bool Beats(const Score& other) const {
    return cameras != other.cameras ? cameras > other.cameras : squared_mm2 < other.squared_mm2;
  }
};

Score ScoreOf(const Eigen::Vector3d& point, std::span<const Sight> sights, double radius_mm) {
  Score score;
  for (size_t i = 0; i < sights.size();) {
    double closest = radius_mm * radius_mm;
    bool inlier = false;
    const int camera = sights[i].camera;
    for (; i < sights.size() && sights[i].camera == camera; ++i) {
      const double d2 = sights[i].SquaredDistanceMm2(point);
      if (d2 > closest || !(sights[i].DepthMm(point) > 0)) continue;
      closest = d2;
      inlier = true;
    }
    if (!inlier) continue;
    ++score.cameras;
    score.squared_mm2 += closest;
  }
  return score;
}

}  // namespace

int DrawsNeeded(double inlier_share, double confidence, int limit) {
  const double hit = inlier_share * inlier_share;
  if (hit >= 1) return 1;
  if (hit <= 0) return limit;
  const double needed = std::ceil(std::log1p(-confidence) / std::log1p(-hit));
  return needed < limit ? static_cast<int>(needed) : limit;
}

std::pair<int, int> DrawPair(int n, Random& random) {
  const int i = static_cast<int>(random.Below(n)), other = static_cast<int>(random.Below(n - 1));
  const int j = other + (other >= i ? 1 : 0);
  return {std::min(i, j), std::max(i, j)};
}

int LeastMajority(int cameras) { return 2 * cameras / 3 + 1; }

int DistinctCameras(std::span<const Sight> sights) {
  int count = 0;
  for (size_t i = 0; i < sights.size(); ++i) count += i == 0 || sights[i].camera != sights[i - 1].camera;
  return count;
}

void InliersAt(const Eigen::Vector3d& point_mm, std::span<const Sight> sights,
               const ConsensusOptions& options, std::vector<int>* inliers) {
  inliers->clear();
  const double radius2 = options.inlier_radius_mm * options.inlier_radius_mm;
  double best_px2 = 0;
  for (size_t i = 0; i < sights.size(); ++i) {
    if (!(sights[i].DepthMm(point_mm) > 0) || sights[i].SquaredDistanceMm2(point_mm) > radius2) continue;
    const double residual_px2 = sights[i].ResidualPx(point_mm).squaredNorm();
    const double limit_px =
        std::max(options.max_residual_sigmas * sights[i].sigma_px, options.min_residual_px);
    if (residual_px2 > limit_px * limit_px) continue;
    if (!inliers->empty() && sights[inliers->back()].camera == sights[i].camera) {
      if (residual_px2 >= best_px2) continue;
      inliers->back() = static_cast<int>(i);
    } else {
      inliers->push_back(static_cast<int>(i));
    }
    best_px2 = residual_px2;
  }
}

Consensus FindConsensus(std::span<const Sight> sights, const ConsensusOptions& options, uint64_t seed) {
  const int n = static_cast<int>(sights.size());
  const int cameras = DistinctCameras(sights);
  const double min_sine = std::sin(options.min_pair_angle_deg * std::numbers::pi / 180);
  Score best;
  Eigen::Vector3d best_point = Eigen::Vector3d::Zero();
  // Tries a pair; false when every camera agrees already, which no other pair can better.
  const auto try_pair = [&](int i, int j) {
    if (sights[i].camera == sights[j].camera) return true;
    const std::optional<Eigen::Vector3d> point =
        MiddleOf(sights[i], sights[j], min_sine, 2 * options.inlier_radius_mm);
    if (!point) return true;
    const Score score = ScoreOf(*point, sights, options.inlier_radius_mm);
    if (score.Beats(best)) {
      best = score;
      best_point = *point;
    }
    return best.cameras < cameras;
  };

  if (static_cast<int64_t>(n) * (n - 1) / 2 <= kMaxHypotheses) {
    bool searching = true;
    for (int i = 0; i < n && searching; ++i) {
      for (int j = i + 1; j < n && searching; ++j) searching = try_pair(i, j);
    }
  } else {
    Random random(seed);
    int draws = kMaxHypotheses;
    for (int k = 0; k < draws; ++k) {
      const auto [i, j] = DrawPair(n, random);
      try_pair(i, j);
      if (IsMajority(best.cameras, cameras)) break;
      draws = std::min(draws, DrawsNeeded(double(best.cameras) / n, kDrawConfidence, kMaxHypotheses));
    }
  }
  Consensus out;
  if (best.cameras < options.min_views) return out;
  out.position_mm = best_point;
  // The middle of two rays is too rough a point to judge residuals by sigma; that comes after the refinement.
  ConsensusOptions by_radius = options;
  by_radius.max_residual_sigmas = std::numeric_limits<double>::infinity();
  InliersAt(best_point, sights, by_radius, &out.inliers);
  return out;
}

}  // namespace weft
