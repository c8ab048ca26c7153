// Puts the frames of several cameras together by their device times.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "capture/camera/camera_source.h"
#include "capture/camera/clock_track.h"
#include "capture/image/raw_frame.h"
#include "capture/sync/ledger.h"
#include "capture/sync/unsynchronized_frames.h"

namespace weft {

// How the clocks of the cameras are related.
enum class ClockDomain {
  kShared,     // synchronized (PTP): device times compare as they are
  kEstimated,  // each its own, put on the host's by readings of the clock, or, where the camera has none, by
               // the quickest arrivals (clock_track.h)
};

// What sets a camera apart from the others of its session.
struct CameraTiming {
  bool own_clock = false;  // among shared clocks: put on theirs by way of the host's
  // No trigger reaches it: sets have its frame whose time fits best (unsynchronized_frames.h).
  bool unsynchronized = false;
};

struct FrameSetOptions {
  int64_t period_ns = 0;               // between triggers; 0: unknown, triggers are counted as they come
  int64_t tolerance_ns = 2'000'000;    // between the frames of a set
  int64_t max_wait_ns = 500'000'000;   // for the last frame of a set, by the host's clock
  int64_t clock_jump_ns = 10'000'000;  // clocks that depart from the host's by more, or by half a period,
                                       // have jumped
  ClockDomain clocks = ClockDomain::kShared;
  int64_t start_wait_ns = 0;  // how long the first set waits until every camera has delivered and its clock
                              // is known to within half the tolerance; frames before are left out, with a
                              // note. A camera that comes back waits as long for its clock. 0: no waiting
  bool drop_incomplete = false;  // sets without every camera are dropped, with their causes in the ledger
  std::vector<CameraTiming> cameras;  // by camera; those that are not there are as the others

  // Unsynchronized cameras define no triggers, so not all can be.
  absl::Status Validate() const;
};

// What the assembler has to say: finished sets in the order of their triggers, and lines for the ledger about
// sets that are not delivered and about events.
struct AssembledSets {
  std::vector<RawFrameSet> sets;
  std::vector<LedgerEntry> entries;
  std::map<size_t, uint64_t> lost;  // by camera: triggers that ended without a frame of it
};

// A trigger counts when any camera reports it or when the period implies it. Each ends as a set or as a
// line, up to the end of the recording; the host's clock bounds their number. A set is delivered when each
// camera has its frame in it, has lost it, is already at a later one, or is disconnected; at the latest
// after max_wait_ns. Clocks that jump are detected (clock_track.h) and corrected, with a note. Frames whose
// times are in doubt are held until a reading of the clock tells. Frames that contradict the larger part of
// the cameras are set aside, with a note, and define no trigger. Bounded: at most kMaxOpenSets sets wait.
// Thread safety: none.
class FrameSetAssembler {
 public:
  static constexpr size_t kMaxOpenSets = 256;

  // Precondition: options are valid. `first_number`: of the first set.
  FrameSetAssembler(std::vector<std::string> camera_ids, const FrameSetOptions& options,
                    uint64_t first_number = 0);

  // What camera `camera` delivered, in its order. `host_time_ns`: now.
  AssembledSets Add(size_t camera, CameraDelivery delivery, int64_t host_time_ns);
  // Advances time. Sets that waited too long are delivered without the late cameras. While all cameras are
  // away, the triggers that the period implies are counted as dropped.
  AssembledSets Advance(int64_t host_time_ns);
  // A set that began before this host time still waits for a camera.
  bool IsWaiting(int64_t before_host_ns) const;
  // The end of the recording was at `end_host_ns`, not after now. Sets that still wait for a camera are cut
  // off, and left out with a note; triggers up to the end that no camera reported are counted as dropped.
  AssembledSets Finish(int64_t host_time_ns, int64_t end_host_ns);
  // False once its readings contradicted its frames: arrivals alone tell of its clock.
  bool IsClockReadable(size_t camera) const { return !cameras_[camera].clock->contradiction_ns(); }
  // Frames of the camera are held until its clock is read.
  bool WantsReading(size_t camera) const { return cameras_[camera].clock->WantsReading(); }

 private:
  struct Loss {
    int64_t time_ns = 0;
    std::string cause;
  };
  struct Camera {
    bool is_connected = true;
    bool has_ended = false;  // it was not disconnected: there is no more
    bool is_silent = false;  // does not answer, and is not yet disconnected
    bool is_clock_doubt_noted = false;
    std::optional<ClockTrack> clock;        // since it was connected
    bool is_clock_known = false;            // well enough to tell which trigger a frame is of
    std::optional<int64_t> clock_since_ns;  // host time of the first frame of this clock
    std::deque<int64_t> unplaced_ns;        // device times of frames while it was not
    uint64_t unplaced_before_begin = 0;
    std::optional<uint64_t> last_id;                     // of the last frame since it was connected
    std::optional<int64_t> first_time_ns, last_time_ns;  // by the common clock
    std::deque<Loss> losses;
    CameraTiming timing;
    std::optional<UnsynchronizedFrames> unsynchronized;
    std::deque<RawFrame> held;            // their times are in doubt
    int64_t held_since_ns = 0;            // host time
    bool is_hold_over = false;            // the doubt lasts: no set waits any more
    std::optional<int64_t> last_host_ns;  // when its last frame was placed
    bool has_jumped = false;              // its clock
    int astray = 0;                       // sets in a row in which it contradicts the others
    std::string astray_cause;             // why its frames are set aside, empty while they are not
    uint64_t set_aside = 0;               // since then
    uint64_t closed_before = 0, closed_first_id = 0, closed_last_id = 0;  // frames after their sets
  };
  struct TimedFrame {
    RawFrame frame;
    int64_t time_ns = 0;  // by the common clock
  };
  struct OpenSet {
    int64_t time_ns = 0;
    int64_t opened_host_ns = 0;
    std::map<size_t, TimedFrame> frames;  // by camera
  };

  void AddFrame(size_t camera, RawFrame frame, int64_t host_time_ns, AssembledSets& out);
  void AddReading(size_t camera, const ClockReading& reading, int64_t host_time_ns, AssembledSets& out);
  // `jump_ns`: of the clock, that came after this frame and is known already.
  void PlaceFrame(size_t camera, RawFrame frame, int64_t host_time_ns, AssembledSets& out,
                  int64_t jump_ns = 0);
  void PutIntoSet(size_t camera, TimedFrame frame, int64_t host_time_ns);
  bool IsClockKnown(Camera& camera, int64_t host_time_ns) const;
  std::string ClockCause() const;
  void AddLoss(size_t camera, const CameraDelivery& delivery, int64_t host_time_ns);
  int64_t CommonTime_ns(const Camera& camera, int64_t device_ns) const;
  const ClockTrack* SharedClock() const;
  std::optional<int64_t> SharedOffset_ns() const;
  void FollowJump(size_t camera, int64_t jump_ns, int64_t host_time_ns, AssembledSets& out);
  // Holding and setting aside: frame_set_strays.cpp.
  // `jump_ns`: of the clock, that has just become known.
  void PlaceHeld(size_t camera, int64_t host_time_ns, AssembledSets& out, int64_t jump_ns = 0);
  void PlaceAnew(size_t camera, int64_t host_time_ns, AssembledSets& out);
  void EndHolding(int64_t host_time_ns, AssembledSets& out);
  void Quarantine(size_t camera, int64_t time_ns, const std::string& cause, int64_t host_time_ns,
                  AssembledSets& out);
  void NoteInStep(size_t camera, int64_t host_time_ns, AssembledSets& out);
  void NoteAfterClosing(size_t camera, uint64_t id, int64_t host_time_ns, AssembledSets& out);
  bool IsAhead(const OpenSet& set, int64_t host_time_ns) const;
  static std::set<size_t> CamerasOf(const OpenSet& set);
  bool IsBetweenTriggers(const OpenSet& set) const;
  bool IsStillOff(const OpenSet& set) const;
  std::string WhyAstray(const OpenSet& set, bool is_ahead) const;
  void Regroup();
  // True where the first open set is no trigger: its frames are set aside.
  bool LeaveAstray(bool timed_out, int64_t host_time_ns, AssembledSets& out);
  void NoteUnreadableClock(size_t camera, int64_t host_time_ns, AssembledSets& out);
  void NoteGap(Camera& camera, const RawFrame& frame, int64_t time_ns);
  ClockTrack NewClock() const;
  void NoteLeftOver(size_t camera, int64_t host_time_ns, AssembledSets& out);
  std::optional<RawFrame> TakeFrame(OpenSet& set, size_t camera);
  void LeaveOutFirst();
  void AddDropped(uint64_t last, int64_t host_time_ns, const std::string& cause, AssembledSets& out) const;
  // True once the first set may begin.
  bool HasBegun(int64_t host_time_ns, AssembledSets& out);
  void Deliver(int64_t host_time_ns, AssembledSets& out);
  bool IsDecided(const OpenSet& set, size_t camera) const;
  std::string WhyMissing(const OpenSet& set, size_t camera, bool timed_out);
  void DeliverFirst(int64_t host_time_ns, AssembledSets& out);
  // Triggers from the last delivered one to this, at least one.
  uint64_t StepsTo(const OpenSet& open, int64_t host_time_ns, AssembledSets& out) const;
  bool AreAllAway() const;
  std::string WhyNoCamera() const;
  void CountUntil(int64_t until_host_ns, int64_t host_time_ns, AssembledSets& out);
  void Note(size_t camera, int64_t host_time_ns, const std::string& cause, AssembledSets& out) const;

  const std::vector<std::string> camera_ids_;
  const FrameSetOptions options_;
  std::vector<Camera> cameras_;
  std::deque<OpenSet> open_;  // by time
  uint64_t next_number_;
  std::optional<int64_t> last_delivered_ns_;
  int64_t last_delivered_host_ns_ = 0;      // when its first frame came
  int64_t last_closed_host_ns_ = 0;         // when it was delivered
  std::set<size_t> last_delivered_of_;      // the cameras that defined it
  std::optional<int64_t> numbers_from_ns_;  // host time of the first set
  uint64_t first_number_;
  std::optional<int64_t> begin_ns_;        // of the first set, where the cameras are waited for
  std::optional<int64_t> first_host_ns_;   // of the first frame of any camera
  uint64_t left_out_ = 0;                  // sets before the first
  int64_t left_out_until_ns_ = INT64_MIN;  // what is earlier belongs to one of them
};

}  // namespace weft
