// How the clock of one camera relates to that of the host.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace weft {

// The camera's clock read on request.
struct ClockReading {
  int64_t host_time_ns = 0;          // CLOCK_REALTIME
  int64_t device_minus_host_ns = 0;  // right to within uncertainty_ns: half the time that the answer took
  int64_t uncertainty_ns = 0;
  std::string ptp_status;                // as the camera names it, "Slave"; empty where it has no PTP
  std::optional<int64_t> ptp_offset_ns;  // from its PTP master, as the camera says
};

// Bounds of host time minus device time. Readings bound it from both sides, arrivals from above, since a
// frame arrives after its exposure. In between, the bounds widen by the drift of quartz clocks. A jump is
// a deviation that no latency explains. It is a frame from the future, one from the past that contradicts
// the camera's frame counter, or one that confirms a reading outside the bounds. Readings alone move no
// frame. Readings that frames contradict are discarded, and only arrivals are used. `Steady` is the
// device's time without jumps. Thread safety: none.
class ClockTrack {
 public:
  // `period_ns`: between triggers, 0 where unknown. `limit_ns`: smaller jumps cannot be distinguished from
  // latency.
  ClockTrack(int64_t period_ns, int64_t limit_ns) : period_ns_(period_ns), limit_ns_(limit_ns) {}

  // What the offset ought to be, before any evidence: departures are jumps.
  void Expect(int64_t offset_ns) { low_ns_ = high_ns_ = offset_ns; }

  // The jump of the device's clock since the frame before, 0 for none. `id`: the camera's count.
  int64_t AddFrame(int64_t device_ns, int64_t host_ns, uint64_t id);
  void AddReading(const ClockReading& reading);

  int64_t Steady_ns(int64_t device_ns) const { return device_ns + correction_ns_; }
  // Host time minus steady time; nothing before the first evidence.
  std::optional<int64_t> offset_ns() const;
  // How far the offset may be off; nothing where arrivals alone tell.
  std::optional<int64_t> uncertainty_ns() const;
  uint64_t frames() const { return frames_; }
  // How far the readings were from the times of the frames; nothing unless they were given up.
  std::optional<int64_t> contradiction_ns() const { return contradiction_ns_; }

 private:
  // A reading outside the bounds, until a frame confirms it or a reading inside them follows.
  struct Suspicion {
    int64_t value_ns = 0;  // what it says of the offset
    int64_t uncertainty_ns = 0;
    int64_t jump_ns = 0;  // of the clock, if it is right
    uint64_t since_frame = 0;
  };

  void Widen(int64_t host_ns);
  int64_t JumpByCount_ns(int64_t device_ns, int64_t late_ns, uint64_t id) const;
  bool IsConfirmed(int64_t bound_ns) const;
  void GiveUpReadings(int64_t contradiction_ns);

  int64_t period_ns_;
  int64_t limit_ns_;
  int64_t correction_ns_ = 0;
  std::optional<int64_t> low_ns_, high_ns_;
  std::optional<int64_t> widened_ns_;   // up to this host time
  std::optional<int64_t> quickest_ns_;  // arrivals alone: the bound from above
  std::optional<Suspicion> suspicion_;
  std::optional<int64_t> contradiction_ns_;
  bool has_reading_ = false;
  int doubtful_readings_ = 0;  // in a row, that no frame confirmed
  int belated_frames_ = 0;     // in a row, later than any that is on its way
  uint64_t frames_ = 0;
  int64_t last_device_ns_ = 0;
  uint64_t last_id_ = 0;
};

}  // namespace weft
