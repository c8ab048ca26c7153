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
  FileLock(FileLock&& other) noexcept : fd_(other.fd_), is_effective_(other.is_effective_) { other.fd_ = -1; }
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

  // False: the file system has no locks, so nobody is kept out.
  bool is_effective() const { return is_effective_; }

 private:
  explicit FileLock(int fd) : fd_(fd) {}

  int fd_;
  bool is_effective_ = true;
};

}  // namespace weft
