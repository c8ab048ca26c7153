#include "capture/camera/clock_track.h"

#include <algorithm>
#include <cstdlib>

namespace weft {
namespace {

constexpr int kMaxDoubtful = 3;                       // readings in a row
constexpr int kMaxBelated = 3;                        // frames in a row
constexpr int64_t kLongestDelay_ns = 10'000'000'000;  // between a frame's time and its arrival
constexpr int64_t kDriftDivisor = 10'000;             // 100 ppm: quartzes of cameras keep to 50

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
  if (quickest_ns_) *quickest_ns_ += drift_ns;
}

int64_t ClockTrack::JumpByCount_ns(int64_t device_ns, int64_t late_ns, uint64_t id) const {
  if (frames_ == 0) return 0;
  if (period_ns_ == 0 || id <= last_id_) return late_ns < -limit_ns_ ? -late_ns : 0;
  const int64_t excess_ns = device_ns - last_device_ns_ - period_ns_ * static_cast<int64_t>(id - last_id_);
  const bool agree =
      (excess_ns < 0) == (late_ns > 0) && std::abs(excess_ns + late_ns) <= std::abs(late_ns) / 2;
  return agree && std::abs(excess_ns) > limit_ns_ && std::abs(late_ns) > limit_ns_ ? excess_ns : 0;
}

// The frame arrived neither before the reading's clock took it nor much later.
bool ClockTrack::IsConfirmed(int64_t bound_ns) const {
  const int64_t late_ns = bound_ns - suspicion_->value_ns;
  return late_ns >= -suspicion_->uncertainty_ns - limit_ns_ &&
         late_ns <= std::max(limit_ns_, std::abs(suspicion_->jump_ns) / 2);
}

int64_t ClockTrack::AddFrame(int64_t device_ns, int64_t host_ns, uint64_t id) {
  Widen(host_ns);
  int64_t jump_ns = 0;
  if (const std::optional<int64_t> offset = offset_ns()) {
    const int64_t bound_ns = host_ns - Steady_ns(device_ns), late_ns = bound_ns - *offset;
    jump_ns = JumpByCount_ns(device_ns, late_ns, id);
    if (jump_ns == 0 && suspicion_ && IsConfirmed(bound_ns)) jump_ns = suspicion_->jump_ns;
    belated_frames_ = jump_ns == 0 && late_ns > kLongestDelay_ns ? belated_frames_ + 1 : 0;
    if (belated_frames_ >= kMaxBelated) {
      belated_frames_ = 0;
      if (has_reading_) {
        GiveUpReadings(late_ns);
        high_ns_ = bound_ns;
      } else {
        jump_ns = -late_ns;
      }
    }
    if (jump_ns != 0) suspicion_.reset();
  }
  correction_ns_ -= jump_ns;
  const int64_t bound_ns = host_ns - Steady_ns(device_ns);
  high_ns_ = std::min(high_ns_.value_or(bound_ns), bound_ns);
  quickest_ns_ = std::min(quickest_ns_.value_or(bound_ns), bound_ns);
  if (low_ns_) low_ns_ = std::min(*low_ns_, *high_ns_);
  ++frames_;
  last_device_ns_ = device_ns;
  last_id_ = id;
  return jump_ns;
}

void ClockTrack::GiveUpReadings(int64_t contradiction_ns) {
  contradiction_ns_ = contradiction_ns;
  suspicion_.reset();
  low_ns_.reset();
  high_ns_ = quickest_ns_;
}

void ClockTrack::AddReading(const ClockReading& reading) {
  if (contradiction_ns_) return;
  Widen(reading.host_time_ns);
  const int64_t value_ns = -reading.device_minus_host_ns - correction_ns_;
  const int64_t low_ns = value_ns - reading.uncertainty_ns, high_ns = value_ns + reading.uncertainty_ns;
  int64_t departure_ns = 0;
  if (high_ns_) {
    const int64_t lowest_ns = low_ns_.value_or(*high_ns_ - kLongestDelay_ns);
    departure_ns = std::max(low_ns - *high_ns_, lowest_ns - high_ns);
  }
  if (departure_ns > limit_ns_) {
    if (!suspicion_) {
      suspicion_ = {value_ns, reading.uncertainty_ns, *offset_ns() - value_ns, frames_};
      doubtful_readings_ = 0;
    }
    ++doubtful_readings_;
    if (doubtful_readings_ >= kMaxDoubtful && frames_ > suspicion_->since_frame)
      GiveUpReadings(std::abs(*offset_ns() - value_ns));
    return;
  }
  suspicion_.reset();
  has_reading_ = true;
  const bool overlaps = (!low_ns_ || *low_ns_ <= high_ns) && (!high_ns_ || *high_ns_ >= low_ns);
  low_ns_ = overlaps && low_ns_ ? std::max(*low_ns_, low_ns) : low_ns;
  high_ns_ = overlaps && high_ns_ ? std::min(*high_ns_, high_ns) : high_ns;
}

}  // namespace weft
