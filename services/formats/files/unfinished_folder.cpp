#include "services/formats/files/unfinished_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr char kInside[] = ".unfinished";

std::string Whole(const std::string& place) {
  std::error_code error;
  fs::path path = fs::absolute(place, error).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  return path.string();
}

// It cannot be replaced by another folder.
bool IsFixed(const std::string& place) {
  struct stat own, above, here;
  if (stat(place.c_str(), &own) != 0 || !S_ISDIR(own.st_mode)) return false;
  const std::string parent = fs::path(place).parent_path().string();
  const bool is_root = stat(parent.c_str(), &above) != 0 || own.st_dev != above.st_dev || place == parent;
  return is_root || (stat(".", &here) == 0 && here.st_dev == own.st_dev && here.st_ino == own.st_ino);
}

absl::Status InTheWay(const std::string& place) {
  return absl::AlreadyExistsError(absl::StrCat(place, ": is there already; name another folder"));
}

// Nothing, or a folder without anything of somebody.
bool IsFree(const std::string& place) {
  std::error_code error;
  const fs::file_status there = fs::symlink_status(place, error);
  if (!fs::exists(there)) return true;
  if (!fs::is_directory(there)) return false;
  return std::all_of(fs::directory_iterator(place, error), {}, [](const fs::directory_entry& entry) {
    return entry.path().filename() == kInside || entry.path().filename() == "lost+found";
  });
}

bool HasName(int folder, const std::string& path) {
  struct stat held, named;
  return fstat(folder, &held) == 0 && lstat(path.c_str(), &named) == 0 && held.st_dev == named.st_dev &&
         held.st_ino == named.st_ino;
}

absl::Status Empty(const std::string& folder) {
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    fs::remove_all(it->path(), error);
  if (!error) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat(folder,
                                                  ": is left of a run that was stopped and cannot be ",
                                                  "emptied (", error.message(), "); remove it"));
}

}  // namespace

absl::StatusOr<UnfinishedFolder> UnfinishedFolder::Begin(const std::string& place) {
  const std::string whole = Whole(place);
  if (!IsFree(whole)) return InTheWay(place);
  return BeginAt(whole, IsFixed(whole) ? absl::StrCat(whole, "/", kInside) : whole + kUnfinishedEnd);
}

absl::StatusOr<UnfinishedFolder> UnfinishedFolder::BeginBeside(const std::string& place) {
  const std::string whole = Whole(place);
  return BeginAt(whole, whole + kUnfinishedEnd);
}

absl::StatusOr<UnfinishedFolder> UnfinishedFolder::BeginAt(const std::string& place,
                                                           const std::string& path) {
  constexpr int kTries = 5;
  for (int i = 0; i < kTries; ++i) {
    WEFT_RETURN_IF_ERROR(CreateFolders(path));
    UniqueFd folder(open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (!folder.open()) return WriteError(path, errno);
    const bool is_locked = flock(folder.get(), LOCK_EX | LOCK_NB) == 0;
    if (!is_locked && errno == EWOULDBLOCK) {
      return absl::FailedPreconditionError(
          absl::StrCat(place, ": another process writes it; wait for its end, or name another folder"));
    }
    if (!HasName(folder.get(), path)) continue;  // its last writer renamed or removed it meanwhile
    WEFT_RETURN_IF_ERROR(Empty(path));
    return UnfinishedFolder(place, path, std::move(folder));
  }
  return absl::UnavailableError(absl::StrCat(path, ": others make and remove it all the time"));
}

UnfinishedFolder::~UnfinishedFolder() {
  if (!lock_.open() || !HasName(lock_.get(), path_)) return;
  RemoveTree(path_);
}

absl::Status UnfinishedFolder::MoveUp() {
  std::error_code error;
  for (fs::directory_iterator it(path_, error), end; !error && it != end; it.increment(error)) {
    const fs::path to = fs::path(place_) / it->path().filename();
    if (renameat2(AT_FDCWD, it->path().c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) != 0)
      return errno == EEXIST ? InTheWay(to.string()) : WriteError(to.string(), errno);
  }
  if (!error) fs::remove(path_, error);
  if (error) return WriteError(place_, error.value());
  lock_.Close();
  const UniqueFd place(open(place_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return place.open() ? SyncFolder(place.get(), place_) : absl::OkStatus();
}

absl::Status UnfinishedFolder::Publish() {
  WEFT_RETURN_IF_ERROR(SyncFolder(lock_.get(), path_));
  if (fs::path(path_).parent_path() == place_) return MoveUp();
  if (rename(path_.c_str(), place_.c_str()) != 0) {
    const int error = errno;
    return error == ENOTEMPTY || error == EEXIST || error == ENOTDIR ? InTheWay(place_)
                                                                     : WriteError(place_, error);
  }
  lock_.Close();
  const std::string parent = fs::path(place_).parent_path().string();
  const UniqueFd above(open(parent.empty() ? "." : parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return above.open() ? SyncFolder(above.get(), parent) : absl::OkStatus();
}

}  // namespace weft
