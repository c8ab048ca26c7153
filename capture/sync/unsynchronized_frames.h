// Frames of an unsynchronized camera, for frame sets whose triggers other cameras define.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "capture/image/raw_frame.h"

namespace weft {

// Counts on from one trigger to the next: a camera of the same rate has one frame in every set, at any phase
// and however unsteady it is. A frame more than three quarters of a period from its trigger is not used;
// counting begins anew with the frame nearest to the trigger. So a faster camera has a frame left over now
// and then, and a slower one leaves a trigger without. At most kMaxWaiting frames wait. Thread safety: none.
class UnsynchronizedFrames {
 public:
  static constexpr size_t kMaxWaiting = 64;

  // `period_ns`: between triggers, > 0.
  explicit UnsynchronizedFrames(int64_t period_ns) : period_ns_(period_ns) {}

  // Frames come in the order of their times and of the camera's count.
  void Add(RawFrame frame, int64_t time_ns);
  // No frame that is still to come belongs to this trigger.
  bool Knows(int64_t trigger_ns) const;
  // When the frame of this trigger is taken.
  int64_t Expected_ns(int64_t trigger_ns) const { return trigger_ns + (last_ ? last_->offset_ns : 0); }
  // The frame of this trigger. Triggers come in order. Frames from before are left over.
  std::optional<RawFrame> Take(int64_t trigger_ns);
  // Which frames were left over since it was last asked, in words; empty where there are none.
  std::string TakeLeftOver();
  // The camera began to count anew.
  void Restart();

 private:
  struct Waiting {
    RawFrame frame;
    int64_t time_ns = 0;
  };
  struct Taken {
    uint64_t id = 0;
    int64_t trigger_ns = 0, offset_ns = 0;
  };

  void LeaveFirst();
  uint64_t ExpectedId(int64_t trigger_ns) const;
  std::optional<size_t> Find(uint64_t id) const;
  std::optional<size_t> Nearest(int64_t trigger_ns) const;
  bool IsNear(size_t index, int64_t trigger_ns) const;

  int64_t period_ns_;
  std::deque<Waiting> waiting_;
  std::optional<Taken> last_;
  int misses_ = 0;
  std::optional<uint64_t> newest_id_;
  int64_t newest_ns_ = 0;
  uint64_t left_over_ = 0, first_left_id_ = 0, last_left_id_ = 0;
};

}  // namespace weft
