// Records frame sets: threads and a bounded queue around the files of a take.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/image/raw_frame.h"
#include "capture/take/take_writer.h"

namespace weft {

struct RecorderOptions {
  TakeWriterOptions take;
  uint64_t queue_bytes =
      uint64_t{1} << 30;        // of frames that wait for the disk; a full queue drops whole sets
  int writers = 2;              // threads; each has its own cameras
  int flush_interval_ms = 200;  // between flushes to the disk: what a crash may cost
  uint64_t low_disk_bytes = uint64_t{2} << 30;  // recording stops when less is free
  int slow_write_ms = 1000;                     // writes that take longer are noted in the ledger
  int stop_timeout_ms = 30000;                  // Stop gives up when the disk makes no progress for so long

  absl::Status Validate() const;
};

struct RecorderCounters {
  uint64_t sets_offered = 0;
  uint64_t sets_recorded = 0;   // flushed to the disk and in the ledger
  uint64_t sets_dropped = 0;    // not in the take; the ledger says why
  uint64_t frames_missing = 0;  // in recorded sets
  uint64_t bytes_written = 0;
  uint64_t queued_bytes = 0;
  uint64_t queued_bytes_peak = 0;
  std::optional<uint64_t> room_bytes;  // for further frames, down to the low-disk mark; once it was looked at
  std::string stop_cause;              // why the recorder takes no more sets; empty while it does
};

// Every set that is offered ends in the ledger: recorded whole, or dropped whole with its cause. A set is
// acknowledged once it is on the disk. After a write error or at the low-disk mark the recorder stops taking
// sets, keeps what is acknowledged, and says so. Thread safety: one thread offers; any thread may call Note
// and Counters.
class Recorder {
 public:
  // Called in order with each set that is on the disk, from a thread of the recorder.
  using Acknowledged = std::function<void(uint64_t set)>;

  static absl::StatusOr<std::unique_ptr<Recorder>> Start(const std::string& folder,
                                                         const std::vector<std::string>& camera_ids,
                                                         const RecorderOptions& options,
                                                         Acknowledged acknowledged = nullptr);
  // As Stop, with the result lost.
  ~Recorder();

  // Never waits for the disk. False: the set was dropped. Sets come in the order of their numbers.
  bool Offer(RawFrameSet set);
  // Waits for room instead of dropping; for sources that can wait. False: the recorder has stopped.
  bool OfferAndWait(RawFrameSet set);

  // A line in the ledger, of one camera or of all (empty).
  void Note(const std::string& camera_id, const std::string& cause);
  // Sets that the source dropped before they came here.
  void NoteDropped(uint64_t first_set, uint64_t last_set, int64_t device_time_ns, const std::string& cause);

  RecorderCounters Counters() const;

  // Writes what is queued, closes the take and joins the threads. The first write error; DeadlineExceeded:
  // the disk does not answer, the take wants `weft take recover`.
  absl::Status Stop();

 private:
  struct Shared;
  explicit Recorder(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}
  std::shared_ptr<Shared> shared_;
};

}  // namespace weft
