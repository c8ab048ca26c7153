// The largest set of rays that meet in one point.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "base/random.h"
#include "triangulation/sight.h"
#include "triangulation/triangulate.h"

namespace weft {

// Pairs of rays that are tried; all where there are fewer.
inline constexpr int kMaxHypotheses = 64;

// Probability of having tried a pair of inliers that ends the sampling.
inline constexpr double kDrawConfidence = 0.9999;

struct Consensus {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  std::vector<int> inliers;  // indices into the sights, one per camera, ordered
};

// Draws needed to meet a pair of inliers with the confidence asked for, when a share of the rays are inliers;
// at most `limit`.
int DrawsNeeded(double inlier_share, double confidence, int limit);

// A pair of 0 to n - 1, the smaller first.
std::pair<int, int> DrawPair(int n, Random& random);

// So many of the cameras agreeing end the search: what the others see can only be less.
int LeastMajority(int cameras);
inline bool IsMajority(int agreeing, int cameras) { return agreeing >= LeastMajority(cameras); }

// Number of distinct cameras; `sights` ordered by camera.
int DistinctCameras(std::span<const Sight> sights);

// The inliers of a point: within the radius, in front of the camera, residual within the limit by sigma.
// Of several sights of one camera, only the one with the smallest residual. `sights` ordered by camera.
void InliersAt(const Eigen::Vector3d& point_mm, std::span<const Sight> sights,
               const ConsensusOptions& options, std::vector<int>* inliers);

// RANSAC over pairs of rays: all pairs where these are at most max_hypotheses, else a sample drawn from
// `seed` that ends with a majority. Pairs that miss each other by more than both radii are passed over. The
// hypothesis with most inliers wins, the one of smallest distances among equals. Empty inliers
// where no pair gathers min_views. `sights` ordered by camera; options.seed is not used, pass one that is the
// node's own.
Consensus FindConsensus(std::span<const Sight> sights, const ConsensusOptions& options, uint64_t seed);

}  // namespace weft
