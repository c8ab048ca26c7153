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

// The smallest value of the last 64 to 127 values.
class RecentLeast {
 public:
  void Add(int64_t value);
  // Nothing before the eighth value.
  std::optional<int64_t> value() const;
  void Reset() { *this = {}; }

 private:
  int count_ = 0;  // in the window that fills
  std::optional<int64_t> filling_, full_;
};

// Bounds of host time minus device time. Readings bound it from both sides, arrivals from above, since a
// frame arrives after its exposure. In between, the bounds widen by the drift of quartz clocks. A jump is
// a deviation that no latency explains:
// - the camera's count of frames and their arrival both contradict the device time, by the same amount;
// - a reading is outside the bounds, and a frame confirms it.
// Evidence that tells too little makes a doubt: the frames since then are best kept until it ends. A reading
// ends it, or further frames do. Readings alone move no frame. Readings that frames contradict are
// discarded, and only arrivals are used. `Steady` is the device's time without jumps. Thread safety: none.
class ClockTrack {
 public:
  // `period_ns`: between triggers, 0 where unknown. `limit_ns`: smaller jumps cannot be distinguished from
  // latency. `sure_ns`: larger ones need no second frame.
  ClockTrack(int64_t period_ns, int64_t limit_ns, int64_t sure_ns)
      : period_ns_(period_ns), limit_ns_(limit_ns), sure_ns_(sure_ns) {}

  // What the offset ought to be, before any evidence: departures are jumps.
  void Expect(int64_t offset_ns) { low_ns_ = high_ns_ = offset_ns; }
  // How long frames took to arrive so far, where this clock begins anew.
  void ExpectLatencyOf(const ClockTrack& before) { latency_ns_ = before.latency_ns_; }

  // The jump of the device's clock, 0 for none. `id`: the camera's count. jumped_since_id() says since when.
  int64_t AddFrame(int64_t device_ns, int64_t host_ns, uint64_t id);
  // As AddFrame: a jump that frames in doubt confirm.
  int64_t AddReading(const ClockReading& reading);

  // The frames since the doubt began may be from before or after a jump.
  bool IsInDoubt() const { return doubt_.has_value(); }
  // They came before their own times, or both count and arrival say other times: theirs are wrong.
  bool AreTimesWrong() const { return doubt_ && (doubt_->is_impossible || doubt_->counted_ns != 0); }
  // A reading would end the doubt.
  bool WantsReading() const { return doubt_ && has_reading_ && !contradiction_ns_; }
  // Device time and count do not agree, and the arrivals did not say which is right.
  bool IsUneven() const { return unexplained_ns_ != 0; }
  // Nobody can say: what the device says counts as it is.
  void EndDoubt();
  // The last jump was before the frame of this count, which may be one of earlier calls.
  uint64_t jumped_since_id() const { return jumped_since_id_; }
  // The last jump is known from readings alone, to within their uncertainty.
  bool IsJumpVague() const { return is_jump_vague_; }

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
  // Frames whose times may be wrong. None of them moves a bound.
  struct Doubt {
    bool is_ahead = false;       // arrived earlier than usual
    bool is_impossible = false;  // even before they were taken
    int64_t counted_ns = 0;      // the jump by the camera's count, 0 where that is steady
    uint64_t counted_since_id = 0;
    int64_t quickest_ns = 0;   // of these frames, host time minus steady time
    int frames = 0;            // of these
    int readings_against = 0;  // that found the clock unchanged
  };

  void Widen(int64_t host_ns);
  void Tighten(int64_t bound_ns);
  int64_t Excess_ns(int64_t device_ns, uint64_t id) const;
  int64_t JumpByFrame_ns(int64_t device_ns, int64_t bound_ns, uint64_t id);
  int64_t JumpInDoubt_ns(int64_t early_ns, int64_t excess_ns, uint64_t id);
  void DoubtWhereDue(int64_t bound_ns, int64_t early_ns, int64_t excess_ns, uint64_t id);
  bool IsConfirmed(int64_t bound_ns) const;
  int64_t Sharpened_ns(int64_t jump_ns, int64_t uncertainty_ns, int64_t counted_ns);
  void Correct(int64_t jump_ns);
  void GiveUpReadings(int64_t contradiction_ns);
  int64_t Belated_ns(int64_t bound_ns, int64_t late_ns);
  int64_t Suspect(const ClockReading& reading, int64_t value_ns);

  int64_t period_ns_;
  int64_t limit_ns_, sure_ns_;
  int64_t correction_ns_ = 0;
  std::optional<int64_t> low_ns_, high_ns_;
  std::optional<int64_t> widened_ns_;   // up to this host time
  std::optional<int64_t> quickest_ns_;  // arrivals alone: the bound from above
  RecentLeast latency_ns_;              // of frames, beyond the offset
  std::optional<Suspicion> suspicion_;
  std::optional<Doubt> doubt_;
  std::optional<int64_t> contradiction_ns_;
  bool has_reading_ = false;
  bool is_jump_vague_ = false;
  int doubtful_readings_ = 0;   // in a row, that no frame confirmed
  int belated_frames_ = 0;      // in a row, later than any that is on its way
  int64_t unexplained_ns_ = 0;  // by which device times ran ahead of the count, and arrivals did not say why
  uint64_t unexplained_since_id_ = 0, jumped_since_id_ = 0;
  uint64_t frames_ = 0;
  int64_t last_device_ns_ = 0;
  uint64_t last_id_ = 0;
};

}  // namespace weft
