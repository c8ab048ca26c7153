// <take>/clocks.csv: what the cameras' clocks said while the take was recorded.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "capture/camera/clock_track.h"
#include "capture/file/posix_file.h"

namespace weft {

std::string ClockLogFile(const std::string& take);

struct LoggedReading {
  std::string camera_id;
  ClockReading reading;
};

// Whether the clock jumped between two readings of it: by more than they may be wrong and a clock may drift.
bool IsClockJump(const ClockReading& before, const ClockReading& after);

// Keeps the last reading of each camera and writes all. Thread safety: all members may be called from any
// thread.
class ClockLog {
 public:
  explicit ClockLog(std::vector<std::string> camera_ids)
      : camera_ids_(std::move(camera_ids)), last_(camera_ids_.size()), is_distrusted_(camera_ids_.size()) {}

  // Readings are written from here on. Errors name the file.
  absl::Status Open(const std::string& take);
  // Writes the last line, without which the file counts as cut. What an earlier call could not write, on a
  // full disk for example, is written first. OK where no file is open.
  absl::Status Close();
  // At the end of the file, 16 hex digits; empty before Close.
  std::string end_checksum() const;

  // What the ledger should know: the camera's PTP changed its state. Empty otherwise.
  std::string Add(size_t camera, const ClockReading& reading);

  std::optional<ClockReading> Last(size_t camera) const;
  // Its readings say nothing: from here on it has none.
  void Distrust(size_t camera);

 private:
  void Append(const std::string& line) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status WritePending() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::vector<std::string> camera_ids_;
  mutable Mutex mutex_;
  std::optional<PosixFile> file_ ABSL_GUARDED_BY(mutex_);
  std::string pending_ ABSL_GUARDED_BY(mutex_);  // lines that are not in the file yet
  uint64_t written_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  uint64_t checksum_ ABSL_GUARDED_BY(mutex_) = 0;  // of the last line
  uint64_t readings_ ABSL_GUARDED_BY(mutex_) = 0;
  std::string end_checksum_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::optional<ClockReading>> last_ ABSL_GUARDED_BY(mutex_);
  std::vector<bool> is_distrusted_ ABSL_GUARDED_BY(mutex_);
};

struct ParsedClockLog {
  std::vector<LoggedReading> readings;  // of the lines that are whole
  bool has_checksums = true;            // false: of 0.2.0 or before
  bool has_end = false;
  std::string end_checksum;  // 16 hex digits; empty without an end
  uint64_t damaged_lines = 0;
  bool is_cut = false;  // within its last line, which counts as damaged
  std::string damage;   // the first: "line 7 is not as it was written"

  // Whether a take whose v1::Take.clocks_checksum this is may have it; any, where the take says nothing. One
  // that is cut has no end to compare, but its lines have checksums of their own.
  bool MayBeOf(const std::string& checksum) const {
    return checksum.empty() || (has_checksums && (!has_end || end_checksum == checksum));
  }
};

// NotFound: the take has none (imported, or of an older version). DataLoss: it is something else. Errors of
// PosixFile.
absl::StatusOr<ParsedClockLog> ParseClockLog(const std::string& take);

// What take.json says of the log.
struct ClockLogSeal {
  std::string checksum;    // v1::Take.clocks_checksum
  bool is_closed = false;  // the take
};
// What of a take's log may be used.
struct UsableClockLog {
  std::vector<LoggedReading> readings;  // all that are whole, where take.json names no other log
  std::string damage;                   // in words; empty: nothing is wrong with it, or the take has none
};
UsableClockLog ReadClockLog(const std::string& take, const ClockLogSeal& seal);

// The whole log as text, with its end.
std::string ClockLogText(const std::vector<LoggedReading>& readings);

}  // namespace weft
