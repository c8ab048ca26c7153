#include "capture/clock_track.h"

#include <algorithm>
#include <cstdlib>

namespace weft {
namespace {

constexpr int kMaxDoubtful = 3;
constexpr int64_t kDriftDivisor = 10'000;  // 100 ppm: quartzes of cameras keep to 50

}  // namespace

std::optional<int64_t> ClockTrack::offset_ns() const {
  if (low_ns_ && high_ns_) return *low_ns_ + (*high_ns_ - *low_ns_) / 2;
  return high_ns_;
}

std::optional<int64_t> ClockTrack::uncertainty_ns() const {
  if (!low_ns_ || !high_ns_) return std::nullopt;
  return (*high_ns_ - *low_ns_) / 2;
}

void ClockTrack::Widen(int64_t host_ns) {
  const int64_t since_ns = widened_ns_.value_or(host_ns);
  const int64_t drift_ns = std::max<int64_t>(0, host_ns - since_ns) / kDriftDivisor;
  widened_ns_ = std::max(since_ns, host_ns);
  if (low_ns_) *low_ns_ -= drift_ns;
  if (high_ns_) *high_ns_ += drift_ns;
}

int64_t ClockTrack::AddFrame(int64_t device_ns, int64_t host_ns, uint64_t id) {
  Widen(host_ns);
  int64_t jump_ns = 0;
  if (const std::optional<int64_t> offset = offset_ns(); offset && has_frame_) {
    const int64_t late_ns = host_ns - Steady_ns(device_ns) - *offset;
    if (period_ns_ > 0 && id > last_id_) {
      const int64_t excess_ns =
          device_ns - last_device_ns_ - period_ns_ * static_cast<int64_t>(id - last_id_);
      const bool agree =
          (excess_ns < 0) == (late_ns > 0) && std::abs(excess_ns + late_ns) <= std::abs(late_ns) / 2;
      if (agree && std::abs(excess_ns) > limit_ns_ && std::abs(late_ns) > limit_ns_) jump_ns = excess_ns;
    } else if (late_ns < -limit_ns_) {
      jump_ns = -late_ns;
    }
  }
  correction_ns_ -= jump_ns;
  const int64_t bound_ns = host_ns - Steady_ns(device_ns);
  high_ns_ = std::min(high_ns_.value_or(bound_ns), bound_ns);
  if (low_ns_) low_ns_ = std::min(*low_ns_, *high_ns_);
  has_frame_ = true;
  last_device_ns_ = device_ns;
  last_id_ = id;
  return jump_ns;
}

int64_t ClockTrack::AddReading(const ClockReading& reading) {
  Widen(reading.host_time_ns);
  int64_t value_ns = -reading.device_minus_host_ns - correction_ns_;
  int64_t jump_ns = 0;
  if (low_ns_ && high_ns_) {
    const int64_t above_ns = value_ns - reading.uncertainty_ns - *high_ns_;
    const int64_t below_ns = *low_ns_ - value_ns - reading.uncertainty_ns;
    const bool jumped = std::max(above_ns, below_ns) > limit_ns_;
    // The next frame tells by the camera's count how far, which no reading tells as exactly.
    doubtful_readings_ = jumped ? doubtful_readings_ + 1 : 0;
    if (jumped && period_ns_ > 0 && has_frame_ && doubtful_readings_ < kMaxDoubtful) return 0;
    if (jumped) {
      jump_ns = *offset_ns() - value_ns;
      correction_ns_ -= jump_ns;
      value_ns += jump_ns;
    }
  }
  const int64_t low_ns = value_ns - reading.uncertainty_ns, high_ns = value_ns + reading.uncertainty_ns;
  const bool overlaps = (!low_ns_ || *low_ns_ <= high_ns) && (!high_ns_ || *high_ns_ >= low_ns);
  low_ns_ = overlaps && low_ns_ ? std::max(*low_ns_, low_ns) : low_ns;
  high_ns_ = overlaps && high_ns_ ? std::min(*high_ns_, high_ns) : high_ns;
  return jump_ns;
}

}  // namespace weft
