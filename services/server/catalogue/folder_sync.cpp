#include "services/server/catalogue/folder_sync.h"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"

namespace weft {

absl::Status SyncFolderOf(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const UniqueFd fd(open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return fd.open() ? SyncFolder(fd.get(), folder) : WriteError(folder, errno);
}

absl::StatusOr<FileLock> FileLock::Take(const std::string& path, std::chrono::milliseconds patience) {
  const std::string name = path + ".lock";
  UniqueFd fd(open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
  if (!fd.open()) {
    const int error = errno;
    const std::string message = absl::StrCat(name, ": cannot be opened for writing (", strerror(error), ")");
    if (error == ENOSPC || error == EDQUOT) {
      return absl::ResourceExhaustedError(absl::StrCat(message, "; make room on the disk"));
    }
    return absl::PermissionDeniedError(absl::StrCat(message, "; check the folder's permissions"));
  }
  FileLock lock(std::move(fd));
  const auto until = std::chrono::steady_clock::now() + patience;
  while (flock(lock.fd_.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK && errno != EINTR) {
      lock.is_effective_ = false;
      break;
    }
    if (std::chrono::steady_clock::now() >= until) {
      return absl::FailedPreconditionError(
          absl::StrCat(path, ": in use by another weftd; stop that one, or give another --state folder"));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return lock;
}

}  // namespace weft
