#include "services/files/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/files/unique_fd.h"

namespace weft {
namespace {

int WriteAndFlush(const std::string& path, std::string_view bytes, mode_t mode) {
  UniqueFd file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (!file.open()) return errno;
  if (const int error = WriteAll(file.get(), bytes)) return error;
  if (fsync(file.get()) != 0) return errno;
  return file.Close() == 0 ? 0 : errno;
}

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

bool TakeDigits(std::string_view& text) {
  const size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  text.remove_prefix(digits);
  return digits > 0;
}

bool TakeWord(std::string_view& text, std::string_view word) {
  if (text.substr(0, word.size()) != word) return false;
  text.remove_prefix(word.size());
  return true;
}

}  // namespace

int WriteAll(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    bytes.remove_prefix(static_cast<size_t>(n));
  }
  return 0;
}

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
      return absl::ResourceExhaustedError(
          absl::StrCat(path, ": cannot be written (", strerror(error), "); make room on the disk"));
    case EFBIG:
      return absl::ResourceExhaustedError(absl::StrCat(
          path, ": cannot be written (", strerror(error),
          "); raise the limit on the size of files (ulimit -f), or use a disk that takes larger ones"));
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
  struct stat info;
  if (fstat(file.get(), &info) != 0 || !S_ISREG(info.st_mode)) {
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
    const ssize_t n = read(file.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return absl::UnavailableError(absl::StrCat(path, ": cannot be read (", strerror(errno), ")"));
    if (n == 0) break;  // became shorter meanwhile
    done += static_cast<size_t>(n);
  }
  bytes.resize(done);
  return bytes;
}

absl::Status WriteFileAtomically(const std::string& path, std::string_view bytes, mode_t mode) {
  static std::atomic<uint64_t> counter{0};
  const std::string temporary = absl::StrCat(path, ".tmp.", getpid(), ".", counter++);
  int error = WriteAndFlush(temporary, bytes, mode);
  if (error == 0 && rename(temporary.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    unlink(temporary.c_str());
    return WriteError(path, error);
  }
  const size_t slash = path.rfind('/');
  error = SyncFolderAt(slash == std::string::npos ? "." : path.substr(0, slash));
  return error == 0 ? absl::OkStatus() : WriteError(path, error);
}

absl::Status CopyWholeFile(const std::string& from, const std::string& to) {
  const absl::StatusOr<std::string> bytes = ReadWholeFile(from);
  return bytes.ok() ? WriteFileAtomically(to, *bytes) : bytes.status();
}

bool IsTemporaryNameOf(std::string_view name, std::string_view file) {
  return TakeWord(name, file) && TakeWord(name, ".tmp.") && TakeDigits(name) && TakeWord(name, ".") &&
         TakeDigits(name) && name.empty();
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
