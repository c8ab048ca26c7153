#include "capture/file/posix_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/error_reason.h"
#include "base/status_macros.h"

namespace weft {

absl::Status FileError(const std::string& path, const std::string& what, int error) {
  const std::string text = absl::StrCat(path, ": ", what, " (", strerror(error), ")");
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return absl::NotFoundError(text);
    case EACCES:
    case EPERM:
    case EROFS:
      return absl::PermissionDeniedError(absl::StrCat(text, "; choose a folder that you may use"));
    case EEXIST:
      return absl::AlreadyExistsError(text);
    case ENOSPC:
    case EDQUOT:
      return WithReason(absl::ResourceExhaustedError(absl::StrCat(text, "; make room on the disk")),
                        ErrorReason::kDiskFull);
    case EFBIG:
      return WithReason(
          absl::ResourceExhaustedError(absl::StrCat(
              text,
              "; raise the limit on the size of files (ulimit -f), or use a disk that takes larger ones")),
          ErrorReason::kDiskFull);
    default:
      return absl::UnavailableError(text);
  }
}

absl::StatusOr<PosixFile> PosixFile::Open(const std::string& path, int flags) {
  // Without O_NONBLOCK a FIFO that nobody writes would never be opened.
  const int fd = open(path.c_str(), flags | O_CLOEXEC | O_NONBLOCK, 0644);
  if (fd < 0) return FileError(path, "cannot be opened", errno);
  PosixFile file(path, fd);
  if (const absl::StatusOr<uint64_t> size = file.Size(); !size.ok()) return size.status();
  return file;
}

PosixFile::PosixFile(PosixFile&& other) noexcept
    : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)) {}

PosixFile& PosixFile::operator=(PosixFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(fd_, other.fd_);
  return *this;
}

PosixFile::~PosixFile() {
  if (fd_ >= 0) close(fd_);
}

absl::StatusOr<uint64_t> PosixFile::Size() const {
  struct stat info {};
  if (fstat(fd_, &info) != 0) return FileError(path_, "has no size", errno);
  if (!S_ISREG(info.st_mode)) return absl::InvalidArgumentError(absl::StrCat(path_, ": not a file"));
  return static_cast<uint64_t>(info.st_size);
}

absl::Status PosixFile::ReadAt(void* bytes, size_t size, uint64_t offset_bytes) const {
  auto* at = static_cast<uint8_t*>(bytes);
  while (size > 0) {
    const ssize_t n = pread(fd_, at, size, static_cast<off_t>(offset_bytes));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return FileError(path_, "cannot be read", errno);
    if (n == 0) return absl::OutOfRangeError(absl::StrCat(path_, ": ends at byte ", offset_bytes));
    at += n;
    size -= static_cast<size_t>(n);
    offset_bytes += static_cast<uint64_t>(n);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> PosixFile::ReadAll() const {
  WEFT_ASSIGN_OR_RETURN(const uint64_t size, Size());
  std::string bytes(size, '\0');
  WEFT_RETURN_IF_ERROR(ReadAt(bytes.data(), bytes.size(), 0));
  return bytes;
}

absl::Status PosixFile::WriteAt(const iovec* pieces, int count, uint64_t offset_bytes) {
  std::vector<iovec> left(pieces, pieces + count);
  size_t first = 0;
  while (first < left.size()) {
    const ssize_t n = pwritev(fd_, left.data() + first, static_cast<int>(left.size() - first),
                              static_cast<off_t>(offset_bytes));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return FileError(path_, "cannot be written", errno);
    if (n == 0) return FileError(path_, "cannot be written", ENOSPC);
    offset_bytes += static_cast<uint64_t>(n);
    auto written = static_cast<size_t>(n);
    while (first < left.size() && written >= left[first].iov_len) written -= left[first++].iov_len;
    if (first < left.size()) {
      left[first].iov_base = static_cast<uint8_t*>(left[first].iov_base) + written;
      left[first].iov_len -= written;
    }
  }
  return absl::OkStatus();
}

absl::Status PosixFile::WriteAt(const void* bytes, size_t size, uint64_t offset_bytes) {
  const iovec piece{const_cast<void*>(bytes), size};
  return WriteAt(&piece, size > 0 ? 1 : 0, offset_bytes);
}

absl::Status PosixFile::SyncData() {
  return fdatasync(fd_) == 0 ? absl::OkStatus() : FileError(path_, "cannot be flushed to the disk", errno);
}

absl::Status PosixFile::Truncate(uint64_t size_bytes) {
  while (ftruncate(fd_, static_cast<off_t>(size_bytes)) != 0) {
    if (errno != EINTR) return FileError(path_, "cannot be cut to its length", errno);
  }
  return absl::OkStatus();
}

absl::Status PosixFile::Preallocate(uint64_t offset_bytes, uint64_t size_bytes) {
  while (fallocate(fd_, 0, static_cast<off_t>(offset_bytes), static_cast<off_t>(size_bytes)) != 0) {
    if (errno == EOPNOTSUPP || errno == ENOSYS) return absl::OkStatus();
    if (errno != EINTR) return FileError(path_, "gets no room", errno);
  }
  return absl::OkStatus();
}

absl::Status SyncFolder(const std::string& folder) {
  const int fd = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return errno == EACCES ? absl::OkStatus() : FileError(folder, "cannot be opened", errno);
  const int error = fsync(fd) == 0 ? 0 : errno;
  close(fd);
  if (error == 0 || error == EINVAL || error == ENOTSUP || error == ENOSYS) return absl::OkStatus();
  return FileError(folder, "cannot be flushed to the disk", error);
}

}  // namespace weft
