// What makes new names in a folder survive a power cut, and what keeps a second process out.
#pragma once

#include <chrono>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// Flushes the folder that holds `path`. Unavailable: the disk refuses.
absl::Status SyncFolderOf(const std::string& path);

// Holds <path>.lock as long as it lives, or until the process ends.
class FileLock {
 public:
  // FailedPrecondition: another process holds it, also after `patience`. PermissionDenied, ResourceExhausted:
  // it cannot be made.
  static absl::StatusOr<FileLock> Take(const std::string& path, std::chrono::milliseconds patience = {});
  FileLock(FileLock&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  explicit FileLock(int fd) : fd_(fd) {}

  int fd_;
};

}  // namespace weft
