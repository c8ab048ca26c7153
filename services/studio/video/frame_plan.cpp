#include "services/studio/video/frame_plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/studio/video/frame_times.h"

namespace weft {
namespace {

constexpr double kSameRate = 1.01;
constexpr double kTie = 1e-6;  // periods; of two sets as near as this, a frame goes to the earlier one
constexpr double kHalf = 0.5 + kTie;

// The slowest camera; of those alike, the one with most frames.
size_t Reference(const std::vector<std::vector<double>>& times_s) {
  size_t best = 0;
  for (size_t camera = 1; camera < times_s.size(); ++camera) {
    const double own = Period_s(times_s[camera]), known = Period_s(times_s[best]);
    const bool is_slower = own > kSameRate * known, is_alike = !is_slower && own * kSameRate >= known;
    if (is_slower || (is_alike && times_s[camera].size() > times_s[best].size())) best = camera;
  }
  return best;
}

size_t Nearest(const std::vector<double>& times_s, double time_s, double tie_s = 0) {
  const auto after = std::ranges::lower_bound(times_s, time_s);
  if (after == times_s.begin()) return 0;
  const auto at = static_cast<size_t>(after - times_s.begin());
  return after == times_s.end() || time_s - times_s[at - 1] <= *after - time_s + tie_s ? at - 1 : at;
}

// Moments of other cameras' frames where the reference has none, a whole number of periods from its nearest
// frame before, or from its first one.
std::vector<double> MomentsBeside(const std::vector<double>& reference_s, double period_s,
                                  const std::vector<std::vector<double>>& times_s) {
  std::vector<std::pair<size_t, int64_t>> places;  // frame of the reference, periods after it
  for (const std::vector<double>& camera : times_s)
    for (const double time_s : camera) {
      if (std::abs(reference_s[Nearest(reference_s, time_s)] - time_s) <= kHalf * period_s) continue;
      const auto after = std::ranges::upper_bound(reference_s, time_s);
      const auto from = static_cast<size_t>(std::max<std::ptrdiff_t>(0, after - reference_s.begin() - 1));
      places.emplace_back(from, std::llround((time_s - reference_s[from]) / period_s));
    }
  std::ranges::sort(places);
  places.erase(std::unique(places.begin(), places.end()), places.end());
  std::vector<double> moments_s;
  for (const auto& [from, periods] : places)
    moments_s.push_back(reference_s[from] + period_s * static_cast<double>(periods));
  return moments_s;
}

}  // namespace

FramePlan PlanFrames(const std::vector<std::vector<double>>& times_s) {
  FramePlan plan;
  plan.frames.resize(times_s.size());
  plan.left_out.resize(times_s.size());
  if (times_s.empty()) return plan;
  plan.reference = Reference(times_s);
  const std::vector<double>& reference_s = times_s[plan.reference];
  if (reference_s.empty()) return plan;
  double period_s = Period_s(reference_s);
  if (period_s <= 0) period_s = 1;  // single pictures
  plan.set_times_s = MomentsBeside(reference_s, period_s, times_s);
  plan.set_times_s.insert(plan.set_times_s.end(), reference_s.begin(), reference_s.end());
  std::ranges::sort(plan.set_times_s);
  for (size_t camera = 0; camera < times_s.size(); ++camera) {
    std::vector<int64_t>& frames = plan.frames[camera];
    frames.assign(plan.set_times_s.size(), -1);
    for (size_t i = 0; i < times_s[camera].size(); ++i) {
      const double time_s = times_s[camera][i];
      const size_t set = Nearest(plan.set_times_s, time_s, kTie * period_s);
      const double off_s = std::abs(plan.set_times_s[set] - time_s);
      const bool is_free = frames[set] < 0;
      const bool is_nearer = !is_free && off_s < std::abs(plan.set_times_s[set] -
                                                          times_s[camera][static_cast<size_t>(frames[set])]);
      const bool takes = off_s <= kHalf * period_s && (is_free || is_nearer);
      plan.left_out[camera] += !takes || is_nearer;
      if (takes) frames[set] = static_cast<int64_t>(i);
    }
  }
  return plan;
}

}  // namespace weft
