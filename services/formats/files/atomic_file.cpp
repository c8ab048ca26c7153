#include "services/formats/files/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/error_reason.h"
#include "base/whole_file.h"
#include "services/ground/process/unique_fd.h"

namespace weft {
namespace {

// 0, or errno.
int SyncFolderFd(int fd) {
  if (fsync(fd) == 0) return 0;
  // File systems that cannot flush a folder keep its names in order by themselves.
  return errno == EINVAL || errno == ENOTSUP || errno == ENOSYS ? 0 : errno;
}

int SyncFolderAt(const std::string& path) {
  const UniqueFd folder(open(path.empty() ? "/" : path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // A folder that one may write to and not read cannot be opened; what it holds is flushed by the system.
  if (!folder.open()) return errno == EACCES ? 0 : errno;
  return SyncFolderFd(folder.get());
}

}  // namespace

absl::Status WriteError(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return absl::NotFoundError(
          absl::StrCat(path, ": cannot be written, its folder does not exist; create it first"));
    case EACCES:
    case EPERM:
    case EROFS:
      return absl::PermissionDeniedError(absl::StrCat(path, ": cannot be written (", strerror(error),
                                                      "); choose a folder that you may write to"));
    case ENOSPC:
    case EDQUOT:
      return WithReason(absl::ResourceExhaustedError(absl::StrCat(
                            path, ": cannot be written (", strerror(error), "); make room on the disk")),
                        ErrorReason::kDiskFull);
    case EFBIG:
      return WithReason(
          absl::ResourceExhaustedError(absl::StrCat(
              path, ": cannot be written (", strerror(error),
              "); raise the limit on the size of files (ulimit -f), or use a disk that takes larger ones")),
          ErrorReason::kDiskFull);
    default:
      return absl::UnavailableError(absl::StrCat(path, ": cannot be written (", strerror(error), ")"));
  }
}

absl::StatusOr<std::string> ReadWholeFile(const std::string& path, uint64_t max_bytes) {
  UniqueFd file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file.open()) {
    if (errno == ENOENT || errno == ENOTDIR) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
    return absl::PermissionDeniedError(absl::StrCat(path, ": cannot be opened (", strerror(errno), ")"));
  }
  return ReadOpenFile(file.get(), path, max_bytes);
}

absl::StatusOr<std::string> ReadOpenFile(int fd, const std::string& path, uint64_t max_bytes) {
  struct stat info;
  if (fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": not a file"));
  }
  const auto size = static_cast<uint64_t>(info.st_size);
  if (size > max_bytes) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": has ", size, " bytes, more than the ", max_bytes,
                                                   " that such a file may have"));
  }
  std::string bytes(size, '\0');
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = read(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return absl::UnavailableError(absl::StrCat(path, ": cannot be read (", strerror(errno), ")"));
    if (n == 0) break;  // became shorter meanwhile
    done += static_cast<size_t>(n);
  }
  bytes.resize(done);
  return bytes;
}

absl::Status WriteFileAtomically(const std::string& path, std::string_view bytes, mode_t mode) {
  int error = ReplaceWholeFile(path, bytes, mode);
  if (error != 0) return WriteError(path, error);
  const size_t slash = path.rfind('/');
  error = SyncFolderAt(slash == std::string::npos ? "." : path.substr(0, slash));
  return error == 0 ? absl::OkStatus() : WriteError(path, error);
}

absl::Status CopyWholeFile(const std::string& from, const std::string& to) {
  const absl::StatusOr<std::string> bytes = ReadWholeFile(from);
  return bytes.ok() ? WriteFileAtomically(to, *bytes) : bytes.status();
}

bool IsTemporaryNameOf(std::string_view name, std::string_view file) {
  return IsTemporaryName(name) && name.rfind(".tmp.") == file.size() && name.substr(0, file.size()) == file;
}

absl::Status CreateFolders(const std::string& path) {
  namespace fs = std::filesystem;
  fs::path whole = fs::path(path).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();
  // Those that are missing, the innermost first.
  std::vector<fs::path> missing;
  std::error_code error;
  for (fs::path at = whole; !at.empty() && !fs::exists(at, error) && !error; at = at.parent_path()) {
    missing.push_back(at);
  }
  error.clear();
  fs::create_directories(path, error);
  if (!error && !fs::is_directory(path, error)) error = std::make_error_code(std::errc::not_a_directory);
  if (error.value() == EEXIST || error.value() == ENOTDIR) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": cannot be made a folder, a file of that name is in the way"));
  }
  if (error) return WriteError(path, error.value());
  for (const fs::path& made : missing) {
    const std::string parent = made.parent_path().string();
    if (const int failed = SyncFolderAt(parent.empty() ? "." : parent)) return WriteError(parent, failed);
  }
  return absl::OkStatus();
}

absl::Status SyncFolder(int fd, const std::string& path) {
  const int error = SyncFolderFd(fd);
  return error == 0 ? absl::OkStatus() : WriteError(path, error);
}

}  // namespace weft
