// audit.log of the state folder: who did what.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/ground/process/unique_fd.h"
#include "weft/v1/access.pb.h"

namespace weft {

std::string AuditLogFile(const std::string& state_folder);

// Appends lines of JSON, an AuditEntry each, to a file that is closed to other users. A file beyond 16 MiB
// becomes audit.log.1, that one audit.log.2, and so on to 9. Entries are handed to the kernel at once and
// not flushed: a power failure may take the last seconds. Where the disk is full entries are lost, which
// `warn` is told once, and their number is the next entry. Thread safety: any thread.
class AuditLog {
 public:
  using Warn = std::function<void(const std::string& message)>;
  static constexpr int64_t kLargestFile_bytes = int64_t{16} << 20;

  // Errors of WriteFileAtomically: the file cannot be opened.
  static absl::StatusOr<std::unique_ptr<AuditLog>> Open(std::string path, Warn warn,
                                                        int64_t largest_bytes = kLargestFile_bytes);
  // Writes what Refused still gathers.
  ~AuditLog();

  // Fills in the time. False: the disk did not take it.
  bool Record(v1::AuditEntry entry);
  // A flood of the same refusals is an entry a second. True where it was recorded at once, which is when the
  // other log should tell, too.
  bool Refused(v1::AuditEntry entry);

 private:
  using Time = std::chrono::steady_clock::time_point;
  using Kind = std::tuple<std::string, std::string, std::string, std::string>;
  struct Gathered {
    Time since;
    v1::AuditEntry entry;  // `times` of it came since
  };

  AuditLog(std::string path, Warn warn, int64_t largest_bytes)
      : path_(std::move(path)), warn_(std::move(warn)), largest_bytes_(largest_bytes) {}
  absl::Status OpenFile() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Append(v1::AuditEntry entry) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool Write(const v1::AuditEntry& entry) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Rotate() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void WriteGathered(Time before) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::string path_;
  const Warn warn_;
  const int64_t largest_bytes_;
  Mutex mutex_;
  UniqueFd file_ ABSL_GUARDED_BY(mutex_);
  int64_t bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  int32_t lost_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<Kind, Gathered> refused_ ABSL_GUARDED_BY(mutex_);
};

// The last `most` entries, oldest first. Lines that are none, as a crash leaves them, are left out. Errors of
// ReadWholeFile; a log that is not there has none.
absl::StatusOr<std::vector<v1::AuditEntry>> ReadAuditLog(const std::string& path, size_t most);

}  // namespace weft
