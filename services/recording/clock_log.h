// <take>/clocks.csv: what the cameras' clocks said while the take was recorded.
#pragma once

#include <cstdint>
#include <fstream>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/camera/clock_track.h"

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

  // What the ledger should know: the camera's PTP changed its state. Empty otherwise.
  std::string Add(size_t camera, const ClockReading& reading);

  std::optional<ClockReading> Last(size_t camera) const;
  // Its readings say nothing: from here on it has none.
  void Distrust(size_t camera);

 private:
  const std::vector<std::string> camera_ids_;
  mutable std::mutex mutex_;
  std::ofstream file_;
  std::vector<std::optional<ClockReading>> last_;
  std::vector<bool> is_distrusted_;
};

// NotFound: the take has none (imported, or of an older version). Lines that are not whole are left out.
absl::StatusOr<std::vector<LoggedReading>> ReadClockLog(const std::string& take);

}  // namespace weft
