#include "triangulation/time_offsets.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kCauchyPx = 1.0;       // residuals beyond this lose weight
constexpr double kCapPx = 2.0;          // of the search: what a wrong identity costs at most
constexpr double kStepPeriods = 0.125;  // of the search
constexpr double kLongGap = 1.5;        // periods
constexpr int kMostSteps = 20;          // of Gauss-Newton
constexpr double kLeastSigmaPeriods = 1e-3;
constexpr double kHuber = 2;  // sigmas

struct TrackPoint {
  double time_s;
  Eigen::Vector2d point;  // undistorted, on the plane z = 1
};
using NodeTracks = std::map<BoardNode, std::vector<TrackPoint>>;

NodeTracks TracksOf(const CameraModel& camera, const CameraFilm& film) {
  NodeTracks tracks;
  for (const TimedObservations& moment : film.moments)
    for (const Observation& seen : moment.observations)
      if (const auto point = camera.Undistort({seen.x_px, seen.y_px}))
        tracks[seen.node].push_back({moment.time_s, *point});
  return tracks;
}

struct Moved {
  Eigen::Vector2d point, per_s;
};

// Cubic where two consecutive points lie on either side, else linear.
std::optional<Moved> At(const std::vector<TrackPoint>& track, double time_s, double period_s) {
  const auto after = std::upper_bound(track.begin(), track.end(), time_s,
                                      [](double t, const TrackPoint& point) { return t < point.time_s; });
  if (after == track.begin() || after == track.end()) return std::nullopt;
  const TrackPoint &a = *(after - 1), &b = *after;
  const double gap_s = b.time_s - a.time_s, longest_s = kLongGap * period_s;
  if (gap_s > longest_s) return std::nullopt;
  const Eigen::Vector2d slope = (b.point - a.point) / gap_s;
  Eigen::Vector2d at_a = slope, at_b = slope;
  if (after - 1 != track.begin() && a.time_s - (after - 2)->time_s <= longest_s && after + 1 != track.end() &&
      (after + 1)->time_s - b.time_s <= longest_s) {
    at_a = (b.point - (after - 2)->point) / (b.time_s - (after - 2)->time_s);
    at_b = ((after + 1)->point - a.point) / ((after + 1)->time_s - a.time_s);
  }
  const double u = (time_s - a.time_s) / gap_s, v = 1 - u;
  // Hermite's cubic, and its derivative.
  return Moved{
      (1 + 2 * u) * v * v * a.point + u * u * (3 - 2 * u) * b.point + gap_s * u * v * (v * at_a - u * at_b),
      6 * u * v * slope + v * (v - 2 * u) * at_a + u * (u - 2 * v) * at_b};
}

struct PairSample {
  double time_s;
  Eigen::Vector3d point, per_s;          // in the first camera; the speed is that of its neighbours alone
  const std::vector<TrackPoint>* track;  // in the second one
  int node;
};

struct Residual {
  double px;
  double per_s;  // its derivative by the offset
  double z;      // the same from the first camera's speed, whose noise is in neither of the others
  int node;
};

// Two cameras; offsets are those of the first one's clock to the second one's.
class CameraPair {
 public:
  CameraPair(const Rig& rig, const CameraFilm& a, const CameraFilm& b, const NodeTracks& tracks_a,
             const NodeTracks& tracks_b, const TimeOffsetOptions& options)
      : period_s_(b.period_s), options_(options) {
    const CameraModel &first = rig.cameras[static_cast<size_t>(a.camera)],
                      &second = rig.cameras[static_cast<size_t>(b.camera)];
    const Eigen::Matrix3d rotation = first.rotation * second.rotation.transpose();
    const Eigen::Vector3d t = first.translation_mm - rotation * second.translation_mm;
    Eigen::Matrix3d cross;
    cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
    essential_ = cross * rotation / std::max(t.norm(), 1e-9);
    focal_px_ = (first.fx_px + first.fy_px) / 2;
    size_t total = 0;
    for (const auto& [node, track] : tracks_a)
      if (tracks_b.contains(node)) total += track.size();
    const size_t stride = total / static_cast<size_t>(options.max_samples) + 1;
    size_t count = 0;
    int number = 0;
    for (const auto& [node, track] : tracks_a) {
      const auto other = tracks_b.find(node);
      if (other == tracks_b.end()) continue;
      for (size_t i = 1; i + 1 < track.size(); ++i) {
        if (count++ % stride != 0) continue;
        const double around_s = track[i + 1].time_s - track[i - 1].time_s;
        if (around_s > 2 * kLongGap * a.period_s) continue;
        const Eigen::Vector2d per_s = (track[i + 1].point - track[i - 1].point) / around_s;
        samples_.push_back({track[i].time_s,
                            track[i].point.homogeneous(),
                            {per_s.x(), per_s.y(), 0},
                            &other->second,
                            number});
      }
      ++number;
    }
  }

  bool has_samples() const { return static_cast<int>(samples_.size()) >= options_.min_samples; }

  struct Found {
    double offset_s = 0, sigma_s = 0;
  };
  std::optional<Found> Find() const {
    const std::optional<double> start = Search();
    return start ? Refine(*start) : std::nullopt;
  }

 private:
  std::vector<Residual> ResidualsAt(double offset_s) const {
    std::vector<Residual> residuals;
    for (const PairSample& sample : samples_) {
      const std::optional<Moved> other = At(*sample.track, sample.time_s + offset_s, period_s_);
      if (!other) continue;
      const Eigen::Vector3d line = essential_ * other->point.homogeneous();
      const Eigen::Vector3d change = essential_ * Eigen::Vector3d(other->per_s.x(), other->per_s.y(), 0);
      const double length = line.head<2>().norm();
      if (length < 1e-9) continue;
      // The line turns too little within the refinement to count in the derivative.
      const double scale = focal_px_ / length;
      residuals.push_back({scale * line.dot(sample.point), scale * change.dot(sample.point),
                           -scale * line.dot(sample.per_s), sample.node});
    }
    return residuals;
  }

  static double Cost(const std::vector<Residual>& residuals) {
    double sum = 0;
    for (const Residual& r : residuals) sum += std::min(std::abs(r.px), kCapPx);
    return sum / static_cast<double>(residuals.size());
  }

  // The best offset of a grid; nothing where another one that is no neighbour is about as good.
  std::optional<double> Search() const {
    const double step_s = kStepPeriods * period_s_;
    const int reach = static_cast<int>(options_.max_offset_s / step_s);
    std::vector<double> costs;
    for (int i = -reach; i <= reach; ++i) {
      const std::vector<Residual> residuals = ResidualsAt(i * step_s);
      costs.push_back(static_cast<int>(residuals.size()) < options_.min_samples ? INFINITY : Cost(residuals));
    }
    const auto best = static_cast<size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
    if (!std::isfinite(costs[best])) return std::nullopt;
    for (size_t i = 1; i + 1 < costs.size(); ++i) {
      const bool is_minimum = costs[i] <= costs[i - 1] && costs[i] <= costs[i + 1];
      const bool is_apart = std::abs(static_cast<double>(i) - static_cast<double>(best)) * kStepPeriods > 1;
      if (is_minimum && is_apart && costs[i] < options_.distinct * costs[best]) return std::nullopt;
    }
    return (static_cast<int>(best) - reach) * step_s;
  }

  // Gauss-Newton with an instrument: least squares would draw offsets to the middle between frames, where
  // interpolation averages two noises. While all are in step, a node stays on its moving line, so the first
  // camera's speed gives the same derivative with noise of its own (Fuller, Measurement Error Models, 1.4).
  std::optional<Found> Refine(double offset_s) const {
    const double start_s = offset_s;
    std::map<int, double> gradients;  // of each node
    double information = 0;
    for (int step = 0; step < kMostSteps; ++step) {
      gradients.clear();
      information = 0;
      double gradient = 0;
      for (const Residual& r : ResidualsAt(offset_s)) {
        const double weight = 1 / (1 + r.px * r.px / (kCauchyPx * kCauchyPx));
        gradients[r.node] += weight * r.px * r.z;
        gradient += weight * r.px * r.z;
        information += weight * r.per_s * r.z;
      }
      if (information <= 0) return std::nullopt;
      const double change_s = -gradient / information;
      offset_s += std::clamp(change_s, -0.5 * period_s_, 0.5 * period_s_);
      if (std::abs(change_s) < 1e-5 * period_s_) break;
    }
    if (std::abs(offset_s - start_s) > period_s_) return std::nullopt;
    double squares = 0;
    for (const auto& [node, gradient] : gradients) squares += gradient * gradient;
    return Found{offset_s, std::max(std::sqrt(squares) / information, kLeastSigmaPeriods * period_s_)};
  }

  const double period_s_;
  const TimeOffsetOptions& options_;
  Eigen::Matrix3d essential_;
  double focal_px_ = 0;
  std::vector<PairSample> samples_;
};

struct PairOffset {
  size_t a, b;
  double offset_s, sigma_s;  // time of b = time of a + offset
};

// Films that pairs tie to each other: those of the largest group.
std::vector<bool> LargestGroup(size_t films, const std::vector<PairOffset>& pairs) {
  std::vector<size_t> group(films);
  for (size_t i = 0; i < films; ++i) group[i] = i;
  for (size_t round = 0; round < films; ++round)
    for (const PairOffset& pair : pairs)
      group[pair.a] = group[pair.b] = std::min(group[pair.a], group[pair.b]);
  std::vector<size_t> sizes(films, 0);
  for (const size_t of : group) ++sizes[of];
  const auto largest = static_cast<size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  std::vector<bool> is_in(films);
  for (size_t i = 0; i < films; ++i) is_in[i] = group[i] == largest;
  return is_in;
}

// Offsets x of all films, x_a - x_b = offset of a pair, with Huber's weights; their mean over the group is
// zero.
std::vector<TimeOffset> Solve(size_t films, const std::vector<PairOffset>& pairs) {
  const std::vector<bool> is_in = LargestGroup(films, pairs);
  const auto n = static_cast<Eigen::Index>(films);
  std::vector<double> weights(pairs.size(), 1);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd covariance;
  double chi2 = 0;
  for (int round = 0; round < 30; ++round) {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
    for (size_t i = 0; i < pairs.size(); ++i) {
      const auto p = static_cast<Eigen::Index>(pairs[i].a), q = static_cast<Eigen::Index>(pairs[i].b);
      const double w = weights[i] / (pairs[i].sigma_s * pairs[i].sigma_s);
      a(p, p) += w, a(q, q) += w, a(p, q) -= w, a(q, p) -= w;
      b(p) += w * pairs[i].offset_s, b(q) -= w * pairs[i].offset_s;
    }
    // The mean of the group, which no pair sees, and films outside of it.
    const double scale = std::max(1e-300, a.trace() / static_cast<double>(n));
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!is_in[static_cast<size_t>(i)]) a(i, i) += scale;
      for (Eigen::Index j = 0; j < n; ++j)
        if (is_in[static_cast<size_t>(i)] && is_in[static_cast<size_t>(j)])
          a(i, j) += scale / static_cast<double>(n);
    }
    covariance = a.inverse();
    x = covariance * b;
    chi2 = 0;
    for (size_t i = 0; i < pairs.size(); ++i) {
      const double z = (x(static_cast<Eigen::Index>(pairs[i].a)) - x(static_cast<Eigen::Index>(pairs[i].b)) -
                        pairs[i].offset_s) /
                       pairs[i].sigma_s;
      chi2 += weights[i] * z * z;
      weights[i] = std::abs(z) > kHuber ? kHuber / std::abs(z) : 1;
    }
  }
  const double freedom = static_cast<double>(pairs.size()) -
                         static_cast<double>(std::count(is_in.begin(), is_in.end(), true)) + 1;
  const double inflation = freedom > 0 ? std::max(1.0, chi2 / freedom) : 1;
  std::vector<TimeOffset> offsets(films);
  for (size_t i = 0; i < films; ++i) {
    if (!is_in[i]) continue;
    const auto at = static_cast<Eigen::Index>(i);
    offsets[i].offset_s = x(at);
    // The mean was held with the weight of one film; its part is no uncertainty.
    const double gauge =
        covariance.row(at).sum() / static_cast<double>(std::count(is_in.begin(), is_in.end(), true));
    offsets[i].sigma_s = std::sqrt(std::max(0.0, covariance(at, at) - gauge) * inflation);
  }
  for (const PairOffset& pair : pairs)
    for (const size_t of : {pair.a, pair.b}) {
      if (!is_in[of]) continue;
      const double r = *offsets[pair.a].offset_s - *offsets[pair.b].offset_s - pair.offset_s;
      ++offsets[of].pairs;
      offsets[of].residual_s += r * r;
    }
  for (TimeOffset& offset : offsets)
    if (offset.pairs > 0) offset.residual_s = std::sqrt(offset.residual_s / offset.pairs);
  return offsets;
}

}  // namespace

absl::Status TimeOffsetOptions::Validate() const {
  if (!(max_offset_s > 0 && max_offset_s <= 60))
    return absl::InvalidArgumentError("max_offset_s must be in (0, 60]");
  if (min_samples < 10 || max_samples < min_samples)
    return absl::InvalidArgumentError("min_samples must be at least 10, max_samples no less");
  if (!(distinct >= 1) || !(max_sigma_periods > 0))
    return absl::InvalidArgumentError("distinct must be at least 1, max_sigma_periods positive");
  return absl::OkStatus();
}

absl::StatusOr<std::vector<TimeOffset>> FindTimeOffsets(const Rig& rig, const std::vector<CameraFilm>& films,
                                                        const TimeOffsetOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  if (films.size() < 2)
    return absl::InvalidArgumentError("offsets are between cameras: two films are needed");
  for (const CameraFilm& film : films)
    if (film.camera < 0 || static_cast<size_t>(film.camera) >= rig.cameras.size() || !(film.period_s > 0))
      return absl::InvalidArgumentError(
          absl::StrCat("film of camera ", film.camera, ", which the rig lacks, or without a rate"));
  std::vector<NodeTracks> tracks(films.size());
  tbb::parallel_for(size_t{0}, films.size(), [&](size_t i) {
    tracks[i] = TracksOf(rig.cameras[static_cast<size_t>(films[i].camera)], films[i]);
  });
  std::vector<std::pair<size_t, size_t>> candidates;
  for (size_t a = 0; a < films.size(); ++a)
    for (size_t b = 0; b < films.size(); ++b)
      if (a != b) candidates.emplace_back(a, b);
  std::vector<std::optional<PairOffset>> found(candidates.size());
  std::vector<char> shared(candidates.size());
  tbb::parallel_for(size_t{0}, candidates.size(), [&](size_t i) {
    const auto [a, b] = candidates[i];
    const CameraPair pair(rig, films[a], films[b], tracks[a], tracks[b], options);
    shared[i] = pair.has_samples();
    if (!shared[i]) return;
    const auto offset = pair.Find();
    if (offset && offset->sigma_s <= options.max_sigma_periods * films[b].period_s)
      // Both directions of a pair share most of their errors.
      found[i] = PairOffset{a, b, offset->offset_s, std::numbers::sqrt2 * offset->sigma_s};
  });
  std::vector<PairOffset> pairs;
  for (const std::optional<PairOffset>& pair : found)
    if (pair) pairs.push_back(*pair);
  if (pairs.empty())
    return absl::FailedPreconditionError(
        std::count(shared.begin(), shared.end(), 1) == 0
            ? "no two cameras see enough cells in common"
            : "the cloth moves too little, or in too regular a way, to tell moments apart");
  return Solve(films.size(), pairs);
}

}  // namespace weft
