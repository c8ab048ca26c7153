// What makes new names in a folder survive a power cut, and what keeps a second process out.
#pragma once

#include <chrono>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

// Flushes the folder that holds `path`. Errors of SyncFolder.
absl::Status SyncFolderOf(const std::string& path);

// Holds <path>.lock as long as it lives, or until the process ends.
class FileLock {
 public:
  // FailedPrecondition: another process holds it, also after `patience`. PermissionDenied, ResourceExhausted:
  // it cannot be made.
  static absl::StatusOr<FileLock> Take(const std::string& path, std::chrono::milliseconds patience = {});

  // False: the file system has no locks, so nobody is kept out.
  bool is_effective() const { return is_effective_; }

 private:
  explicit FileLock(UniqueFd fd) : fd_(std::move(fd)) {}

  UniqueFd fd_;
  bool is_effective_ = true;
};

}  // namespace weft
