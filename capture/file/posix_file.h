// A file by its descriptor, with errors that name it.
#pragma once

#include <sys/uio.h>

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// NotFound, PermissionDenied, ResourceExhausted (disk full) or Unavailable, with file, reason and remedy.
absl::Status FileError(const std::string& path, const std::string& what, int error);

// Thread safety: positioned reads and writes may run beside each other.
class PosixFile {
 public:
  // `flags` as of open(2); files are made with mode 0644. InvalidArgument: a folder, a FIFO or a device.
  static absl::StatusOr<PosixFile> Open(const std::string& path, int flags);
  PosixFile(PosixFile&& other) noexcept;
  PosixFile& operator=(PosixFile&& other) noexcept;
  ~PosixFile();

  const std::string& path() const { return path_; }
  int descriptor() const { return fd_; }

  absl::StatusOr<uint64_t> Size() const;
  // Exactly `size` bytes. OutOfRange: the file ends before.
  absl::Status ReadAt(void* bytes, size_t size, uint64_t offset_bytes) const;
  absl::StatusOr<std::string> ReadAll() const;
  // All of the pieces, one after the other.
  absl::Status WriteAt(const iovec* pieces, int count, uint64_t offset_bytes);
  absl::Status WriteAt(const void* bytes, size_t size, uint64_t offset_bytes);
  // Content, and the size where it changed, are on the disk.
  absl::Status SyncData();
  absl::Status Truncate(uint64_t size_bytes);
  // Reserves room. Where the file system cannot, nothing happens.
  absl::Status Preallocate(uint64_t offset_bytes, uint64_t size_bytes);

 private:
  PosixFile(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}

  std::string path_;
  int fd_ = -1;
};

// The names in the folder are on the disk. Where the file system cannot flush a folder, nothing happens.
absl::Status SyncFolder(const std::string& folder);

}  // namespace weft
