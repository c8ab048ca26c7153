#include "capture/camera/clock_track.h"

#include <algorithm>
#include <cstdlib>

namespace weft {
namespace {

constexpr int kMaxDoubtful = 3;                       // readings in a row
constexpr int kMaxBelated = 3;                        // frames in a row
constexpr int kFramesThatTell = 5;                    // of a small jump backwards, where no reading does
constexpr int64_t kLongestDelay_ns = 10'000'000'000;  // between a frame's time and its arrival
constexpr int64_t kDriftDivisor = 10'000;             // 100 ppm: quartzes of cameras keep to 50
constexpr int kLatencyWindow = 64, kFewestLatencies = 8;

}  // namespace

void RecentLeast::Add(int64_t value) {
  filling_ = std::min(filling_.value_or(value), value);
  if (++count_ < kLatencyWindow) return;
  full_ = filling_;
  filling_.reset();
  count_ = 0;
}

std::optional<int64_t> RecentLeast::value() const {
  if (!full_) return count_ >= kFewestLatencies ? filling_ : std::nullopt;
  return std::min(*full_, filling_.value_or(*full_));
}

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

// By which the device's time went on further than the camera's count; 0 where that says nothing.
int64_t ClockTrack::Excess_ns(int64_t device_ns, uint64_t id) const {
  if (frames_ == 0 || period_ns_ == 0 || id <= last_id_) return 0;
  return device_ns - last_device_ns_ - period_ns_ * static_cast<int64_t>(id - last_id_);
}

// The frame arrived neither before the suspected clock took it nor much later than usual.
bool ClockTrack::IsConfirmed(int64_t bound_ns) const {
  const int64_t late_ns = bound_ns - suspicion_->value_ns - latency_ns_.value().value_or(0);
  const int64_t half_ns = std::abs(suspicion_->jump_ns) / 2;
  return late_ns >= -suspicion_->uncertainty_ns - std::min(limit_ns_, half_ns) &&
         late_ns <= std::max(limit_ns_, half_ns);
}

// The count says it exactly where it says the same.
int64_t ClockTrack::Sharpened_ns(int64_t jump_ns, int64_t uncertainty_ns, int64_t counted_ns) {
  is_jump_vague_ =
      counted_ns == 0 || std::abs(counted_ns - jump_ns) > std::max(limit_ns_ / 2, 2 * uncertainty_ns);
  return is_jump_vague_ ? jump_ns : counted_ns;
}

void ClockTrack::Correct(int64_t jump_ns) {
  correction_ns_ -= jump_ns;
  suspicion_.reset();
  doubt_.reset();
  unexplained_ns_ = 0;
}

void ClockTrack::EndDoubt() {
  if (!doubt_) return;
  if (doubt_->is_ahead) Tighten(doubt_->quickest_ns);
  for (int i = 0; i < doubt_->frames; ++i) latency_ns_.Add(doubt_->quickest_ns - *offset_ns());
  doubt_.reset();
}

void ClockTrack::DoubtWhereDue(int64_t bound_ns, int64_t early_ns, int64_t excess_ns, uint64_t id) {
  const bool can_be_read = has_reading_ && !contradiction_ns_;
  const bool is_used_to = latency_ns_.value().has_value();
  const bool is_impossible = can_be_read && low_ns_ && *low_ns_ - bound_ns > limit_ns_;
  const bool is_ahead = is_impossible || (can_be_read && is_used_to && early_ns > limit_ns_);
  const bool is_counted_back = excess_ns < -limit_ns_ && early_ns < -limit_ns_;
  const bool is_late = can_be_read && is_used_to && early_ns < -limit_ns_ - limit_ns_ / 2;
  if (!is_ahead && !is_counted_back && !is_late) return;
  doubt_ = {is_ahead, is_impossible, std::abs(excess_ns) > limit_ns_ ? excess_ns : 0, id, bound_ns, 1, 0};
}

int64_t ClockTrack::JumpInDoubt_ns(int64_t early_ns, int64_t excess_ns, uint64_t id) {
  if (std::abs(excess_ns) > limit_ns_) {
    if (doubt_->counted_ns == 0) doubt_->counted_since_id = id;
    doubt_->counted_ns += excess_ns;
  }
  ++doubt_->frames;
  if (doubt_->is_ahead) return 0;
  // A stall is over.
  if (-early_ns <= std::max(limit_ns_, -doubt_->counted_ns / 2)) {
    doubt_.reset();
    return 0;
  }
  if (doubt_->frames < kFramesThatTell || doubt_->counted_ns >= -limit_ns_) return 0;
  is_jump_vague_ = false;
  jumped_since_id_ = doubt_->counted_since_id;
  return doubt_->counted_ns;
}

// `bound_ns`: host time minus steady time of this frame. May begin or end a doubt.
int64_t ClockTrack::JumpByFrame_ns(int64_t device_ns, int64_t bound_ns, uint64_t id) {
  const int64_t late_ns = bound_ns - *offset_ns();
  const int64_t early_ns = latency_ns_.value().value_or(0) - late_ns;  // than usual
  const int64_t excess_ns = Excess_ns(device_ns, id);
  if (frames_ > 0 && excess_ns == 0 && (period_ns_ == 0 || id <= last_id_) && late_ns < -sure_ns_)
    return -late_ns;
  // What arrives earlier than it can was not taken when the device says.
  const int64_t ahead_ns =
      excess_ns + unexplained_ns_ + (doubt_ && doubt_->is_ahead ? doubt_->counted_ns : 0);
  is_jump_vague_ = false;
  jumped_since_id_ = id;
  if (ahead_ns > limit_ns_ && early_ns > limit_ns_ && early_ns <= ahead_ns + ahead_ns / 2) {
    if (unexplained_ns_ != 0) jumped_since_id_ = unexplained_since_id_;
    if (doubt_ && doubt_->is_ahead) jumped_since_id_ = 0;
    return ahead_ns;
  }
  const bool agree = excess_ns < 0 && early_ns < 0 && std::abs(excess_ns - early_ns) <= -early_ns / 2;
  if (agree && excess_ns < -sure_ns_ && early_ns < -sure_ns_) return excess_ns;
  const int64_t counted_ns = excess_ns + (doubt_ ? doubt_->counted_ns : 0);
  if (suspicion_ && IsConfirmed(bound_ns)) {
    if (doubt_) jumped_since_id_ = doubt_->counted_ns != 0 ? doubt_->counted_since_id : 0;
    return Sharpened_ns(suspicion_->jump_ns, suspicion_->uncertainty_ns, counted_ns);
  }
  if (frames_ == 0) return 0;
  if (std::abs(excess_ns) > limit_ns_ && early_ns > -limit_ns_) {
    if (unexplained_ns_ == 0) unexplained_since_id_ = id;
    unexplained_ns_ += excess_ns;
  }
  if (std::abs(unexplained_ns_) <= limit_ns_) unexplained_ns_ = 0;
  if (doubt_) {
    doubt_->quickest_ns = std::min(doubt_->quickest_ns, bound_ns);
    doubt_->is_impossible = doubt_->is_impossible || (low_ns_ && *low_ns_ - bound_ns > limit_ns_);
    return JumpInDoubt_ns(early_ns, excess_ns, id);
  }
  DoubtWhereDue(bound_ns, early_ns, excess_ns, id);
  return 0;
}

// Nothing that is on its way takes so long: the readings are wrong, or without them the clock jumped.
int64_t ClockTrack::Belated_ns(int64_t bound_ns, int64_t late_ns) {
  belated_frames_ = late_ns > kLongestDelay_ns ? belated_frames_ + 1 : 0;
  if (belated_frames_ < kMaxBelated) return 0;
  belated_frames_ = 0;
  if (!has_reading_) return -late_ns;
  GiveUpReadings(late_ns);
  high_ns_ = bound_ns;
  return 0;
}

// A frame a little ahead of what readings allow waits for the next one to say which is right.
void ClockTrack::Tighten(int64_t bound_ns) {
  quickest_ns_ = std::min(quickest_ns_.value_or(bound_ns), bound_ns);
  if (frames_ == 0 || !has_reading_ || !low_ns_ || bound_ns >= *low_ns_) {
    high_ns_ = std::min(high_ns_.value_or(bound_ns), bound_ns);
    if (low_ns_) low_ns_ = std::min(*low_ns_, *high_ns_);
  }
  latency_ns_.Add(bound_ns - *offset_ns());
}

int64_t ClockTrack::AddFrame(int64_t device_ns, int64_t host_ns, uint64_t id) {
  Widen(host_ns);
  int64_t jump_ns = 0;
  if (offset_ns()) {
    const int64_t bound_ns = host_ns - Steady_ns(device_ns), late_ns = bound_ns - *offset_ns();
    jump_ns = JumpByFrame_ns(device_ns, bound_ns, id);
    if (jump_ns != 0) {
      belated_frames_ = 0;
    } else {
      jump_ns = Belated_ns(bound_ns, late_ns);
    }
    if (jump_ns != 0) Correct(jump_ns);
  }
  if (!doubt_) Tighten(host_ns - Steady_ns(device_ns));
  ++frames_;
  last_device_ns_ = device_ns;
  last_id_ = id;
  return jump_ns;
}

void ClockTrack::GiveUpReadings(int64_t contradiction_ns) {
  contradiction_ns_ = contradiction_ns;
  suspicion_.reset();
  doubt_.reset();
  latency_ns_.Reset();
  low_ns_.reset();
  high_ns_ = quickest_ns_;
}

// A reading outside the bounds. Frames in doubt confirm it at once, or the next frame may.
int64_t ClockTrack::Suspect(const ClockReading& reading, int64_t value_ns) {
  if (!suspicion_) {
    suspicion_ = {value_ns, reading.uncertainty_ns, *offset_ns() - value_ns, frames_};
    doubtful_readings_ = 0;
  }
  if (doubt_ && IsConfirmed(doubt_->quickest_ns)) {
    const int64_t jump_ns =
        Sharpened_ns(suspicion_->jump_ns, suspicion_->uncertainty_ns, doubt_->counted_ns + unexplained_ns_);
    jumped_since_id_ = doubt_->counted_ns != 0 ? doubt_->counted_since_id : 0;
    Correct(jump_ns);
    return jump_ns;
  }
  ++doubtful_readings_;
  if (doubtful_readings_ >= kMaxDoubtful && frames_ > suspicion_->since_frame)
    GiveUpReadings(std::abs(*offset_ns() - value_ns));
  return 0;
}

int64_t ClockTrack::AddReading(const ClockReading& reading) {
  if (contradiction_ns_) return 0;
  Widen(reading.host_time_ns);
  const int64_t value_ns = -reading.device_minus_host_ns - correction_ns_;
  const int64_t low_ns = value_ns - reading.uncertainty_ns, high_ns = value_ns + reading.uncertainty_ns;
  int64_t departure_ns = 0;
  if (high_ns_) {
    const int64_t lowest_ns = low_ns_.value_or(*high_ns_ - kLongestDelay_ns);
    departure_ns = std::max(low_ns - *high_ns_, lowest_ns - high_ns);
  }
  if (departure_ns > limit_ns_) return Suspect(reading, value_ns);
  suspicion_.reset();
  if (!has_reading_) latency_ns_.Reset();
  has_reading_ = true;
  const bool overlaps = (!low_ns_ || *low_ns_ <= high_ns) && (!high_ns_ || *high_ns_ >= low_ns);
  low_ns_ = overlaps && low_ns_ ? std::max(*low_ns_, low_ns) : low_ns;
  high_ns_ = overlaps && high_ns_ ? std::min(*high_ns_, high_ns) : high_ns;
  if (!doubt_ || 2 * reading.uncertainty_ns > limit_ns_) return 0;
  // The clock is as it was. Frames from before their exposure contradict it.
  if (!doubt_->is_ahead || *low_ns_ - doubt_->quickest_ns <= limit_ns_) {
    EndDoubt();
  } else if (++doubt_->readings_against >= kMaxDoubtful) {
    GiveUpReadings(*offset_ns() - doubt_->quickest_ns);
  }
  return 0;
}

}  // namespace weft
