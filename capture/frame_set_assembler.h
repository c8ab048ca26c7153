// Puts the frames of several cameras together by their device times.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "capture/camera_source.h"
#include "capture/ledger.h"
#include "capture/raw_frame.h"

namespace weft {

// How the clocks of the cameras are related.
enum class ClockDomain {
  kShared,     // synchronized (PTP): device times compare as they are
  kEstimated,  // each its own: offsets come from when the first frames arrived, good to the delay of their
               // arrival
};

struct FrameSetOptions {
  int64_t period_ns = 0;                // between triggers; 0: unknown, triggers are counted as they come
  int64_t tolerance_ns = 2'000'000;     // between the frames of a set
  int64_t max_wait_ns = 500'000'000;    // for the last frame of a set, by the host's clock
  int64_t clock_jump_ns = 100'000'000;  // a clock that departs from the host's by more has jumped
  ClockDomain clocks = ClockDomain::kShared;
  bool drop_incomplete = false;  // sets without every camera are dropped, with their causes in the ledger

  absl::Status Validate() const;
};

// What the assembler has to say: finished sets in the order of their triggers, and lines for the ledger about
// sets that are not delivered and about events.
struct AssembledSets {
  std::vector<RawFrameSet> sets;
  std::vector<LedgerEntry> entries;
};

// Every trigger of which any camera tells, and every one that the period says must have been, ends as a set
// or as a line. A set is delivered when each camera has its frame in it, is known to have lost it, is already
// at a later one, or is disconnected; at the latest after max_wait_ns. Clocks that jump are noticed by
// comparing with the host's clock and corrected, with a note. Bounded: at most kMaxOpenSets sets wait. Thread
// safety: none.
class FrameSetAssembler {
 public:
  static constexpr size_t kMaxOpenSets = 256;

  // Precondition: options are valid. `first_number`: of the first set.
  FrameSetAssembler(std::vector<std::string> camera_ids, const FrameSetOptions& options,
                    uint64_t first_number = 0);

  // What camera `camera` delivered, in its order. `host_time_ns`: now.
  AssembledSets Add(size_t camera, CameraDelivery delivery, int64_t host_time_ns);
  // Time passes: sets that waited too long are delivered without the cameras that are late.
  AssembledSets Advance(int64_t host_time_ns);
  // Delivers what waits.
  AssembledSets Finish(int64_t host_time_ns);

  // The camera's device time plus this is the time by which it is matched.
  int64_t clock_offset_ns(size_t camera) const { return cameras_[camera].offset_ns; }

 private:
  struct Loss {
    int64_t time_ns = 0;
    std::string cause;
  };
  struct Camera {
    bool is_connected = true;
    bool has_clock = false;  // the offset is known
    int64_t offset_ns = 0;
    std::optional<int64_t> last_device_ns;  // of the last frame
    int64_t last_host_ns = 0;
    uint64_t last_id = 0;
    std::optional<int64_t> last_time_ns;  // by the common clock
    std::deque<Loss> losses;
  };
  struct OpenSet {
    int64_t time_ns = 0;
    int64_t opened_host_ns = 0;
    std::map<size_t, RawFrame> frames;
  };

  void AddFrame(size_t camera, RawFrame frame, int64_t host_time_ns, AssembledSets& out);
  void AddLoss(size_t camera, const CameraDelivery& delivery, int64_t host_time_ns);
  void CheckClock(size_t camera, const RawFrame& frame, AssembledSets& out);
  void NoteGap(Camera& camera, const RawFrame& frame, int64_t time_ns);
  void Deliver(int64_t host_time_ns, bool all, AssembledSets& out);
  bool IsDecided(const OpenSet& set, size_t camera) const;
  std::string WhyMissing(const OpenSet& set, size_t camera, bool timed_out);
  void DeliverFirst(int64_t host_time_ns, AssembledSets& out);
  void Note(size_t camera, int64_t host_time_ns, const std::string& cause, AssembledSets& out) const;

  const std::vector<std::string> camera_ids_;
  const FrameSetOptions options_;
  std::vector<Camera> cameras_;
  std::deque<OpenSet> open_;  // by time
  uint64_t next_number_;
  std::optional<int64_t> last_delivered_ns_;
};

}  // namespace weft
