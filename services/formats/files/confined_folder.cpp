#include "services/formats/files/confined_folder.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "base/error_reason.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

constexpr int kFolder = O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;
constexpr int kFile = O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK;

// Why `name` below the folder `parent` could not be opened as a folder.
absl::Status OpenError(int parent, const std::string& name, const std::string& path, int error) {
  struct stat info;
  if (fstatat(parent, name.c_str(), &info, AT_SYMLINK_NOFOLLOW) == 0 && !S_ISDIR(info.st_mode)) {
    if (S_ISLNK(info.st_mode)) {
      return absl::FailedPreconditionError(absl::StrCat(
          path, ": is a symbolic link; results are written into plain folders only, so remove the link"));
    }
    return absl::FailedPreconditionError(
        absl::StrCat(path, ": cannot be a folder of results, a file of that name is in the way"));
  }
  if (error == ENOENT) return absl::NotFoundError(absl::StrCat(path, ": no such folder"));
  if (error == EMFILE || error == ENFILE) {
    return absl::ResourceExhaustedError(absl::StrCat(path, ": cannot be opened (", strerror(error), ")"));
  }
  return absl::PermissionDeniedError(absl::StrCat(path, ": cannot be opened (", strerror(error), ")"));
}

absl::Status NoFile(const std::string& path) {
  return absl::FailedPreconditionError(absl::StrCat(path, ": is no plain file"));
}

// Why the file `name` in the folder `parent`, or a folder on the way to one, could not be opened.
absl::Status OpenFileError(int parent, const std::string& name, const std::string& path, int error) {
  struct stat info;
  if (fstatat(parent, name.c_str(), &info, AT_SYMLINK_NOFOLLOW) == 0) {
    if (S_ISLNK(info.st_mode)) {
      return absl::FailedPreconditionError(absl::StrCat(
          path, ": is a symbolic link, which is not followed; put what it leads to in its place"));
    }
    if (!S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode)) return NoFile(path);
  }
  if (error == ENOENT || error == ENOTDIR) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  const std::string message = absl::StrCat(path, ": cannot be opened (", strerror(error), ")");
  // What was exchanged a moment ago, and is something else by now.
  if (error == ELOOP) return absl::FailedPreconditionError(message);
  if (error == EMFILE || error == ENFILE) return absl::ResourceExhaustedError(message);
  return absl::PermissionDeniedError(message);
}

}  // namespace

absl::StatusOr<ConfinedFolder> ConfinedFolder::Open(const std::string& path) {
  if (path.empty() || path.front() != '/') {
    return absl::InvalidArgumentError(absl::StrCat("\"", path, "\" is no absolute path"));
  }
  const std::vector<std::string> parts = absl::StrSplit(path, '/', absl::SkipEmpty());
  UniqueFd folder(open("/", kFolder | (parts.empty() ? O_RDONLY : O_PATH)));
  std::string walked;
  for (size_t i = 0; folder.open() && i < parts.size(); ++i) {
    absl::StrAppend(&walked, "/", parts[i]);
    const int access = i + 1 == parts.size() ? O_RDONLY : O_PATH;
    UniqueFd next(openat(folder.get(), parts[i].c_str(), kFolder | access));
    if (!next.open()) return OpenError(folder.get(), parts[i], walked, errno);
    folder = std::move(next);
  }
  if (!folder.open()) return absl::PermissionDeniedError(absl::StrCat("/: ", strerror(errno)));
  return ConfinedFolder(std::move(folder), path);
}

absl::StatusOr<ConfinedFolder> ConfinedFolder::Child(const std::string& name, IfMissing missing) const {
  if (missing == IfMissing::kMake) {
    if (mkdirat(fd_.get(), name.c_str(), 0777) == 0) {
      WEFT_RETURN_IF_ERROR(Sync());
    } else if (errno != EEXIST) {
      return WriteError(Named(name), errno);
    }
  }
  UniqueFd child(openat(fd_.get(), name.c_str(), kFolder | O_RDONLY));
  if (!child.open()) return OpenError(fd_.get(), name, Named(name), errno);
  return ConfinedFolder(std::move(child), Named(name));
}

absl::StatusOr<ConfinedFolder> ConfinedFolder::Again() const {
  UniqueFd copy(fcntl(fd_.get(), F_DUPFD_CLOEXEC, 0));
  if (!copy.open()) return absl::ResourceExhaustedError(absl::StrCat(path_, ": ", strerror(errno)));
  return ConfinedFolder(std::move(copy), path_);
}

std::string ConfinedFolder::At(const std::string& name) const {
  return absl::StrCat("/proc/self/fd/", fd_.get(), "/", name);
}

absl::Status ConfinedFolder::InWords(const absl::Status& status) const {
  if (status.ok()) return status;
  return WithMessage(status, absl::StrReplaceAll(status.message(), {{At(""), path_ + "/"}}));
}

absl::StatusOr<UniqueFd> ConfinedFolder::OpenFile(const std::string& path) const {
  const std::vector<std::string> parts = absl::StrSplit(path, '/');
  UniqueFd at;
  std::string walked = path_;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].empty() || parts[i] == "." || parts[i] == "..")
      return absl::InvalidArgumentError(absl::StrCat("\"", path, "\": is no file below ", path_));
    absl::StrAppend(&walked, "/", parts[i]);
    const int parent = i == 0 ? fd_.get() : at.get();
    const int kind = i + 1 < parts.size() ? kFolder | O_PATH : kFile;
    UniqueFd next(openat(parent, parts[i].c_str(), kind));
    if (!next.open()) return OpenFileError(parent, parts[i], walked, errno);
    at = std::move(next);
  }
  struct stat info;
  if (fstat(at.get(), &info) != 0 || !S_ISREG(info.st_mode)) return NoFile(walked);
  return at;
}

absl::StatusOr<std::string> ConfinedFolder::Read(const std::string& name) const {
  const absl::StatusOr<UniqueFd> file = OpenFile(name);
  if (absl::IsFailedPrecondition(file.status()))
    return absl::NotFoundError(absl::StrCat(Named(name), ": no such file"));
  if (!file.ok()) return file.status();
  return ReadOpenFile(file->get(), Named(name));
}

absl::Status ConfinedFolder::Remove(const std::string& name) const {
  if (unlinkat(fd_.get(), name.c_str(), 0) == 0 || errno == ENOENT) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat(Named(name), ": cannot be removed (", strerror(errno), ")"));
}

absl::StatusOr<std::vector<std::string>> ConfinedFolder::Names() const {
  const int fd = openat(fd_.get(), ".", kFolder | O_RDONLY);
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(fd >= 0 ? fdopendir(fd) : nullptr, &closedir);
  if (!entries) {
    const int error = errno;
    if (fd >= 0) close(fd);
    return absl::PermissionDeniedError(absl::StrCat(path_, ": cannot be listed (", strerror(error), ")"));
  }
  std::vector<std::string> names;
  while (const dirent* entry = readdir(entries.get())) {
    const std::string name = entry->d_name;
    if (name != "." && name != "..") names.push_back(name);
  }
  return names;
}

absl::Status ConfinedFolder::Sync() const { return SyncFolder(fd_.get(), path_); }

}  // namespace weft
