#include "services/pipeline/result_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <thread>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "services/files/atomic_file.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;

std::string InFull(const std::string& owner) {
  char host[256] = "";
  gethostname(host, sizeof(host) - 1);
  return absl::StrCat(owner, ", process ", getpid(), " on ", host);
}

// What the holder wrote about itself; one line of printable characters.
std::string HolderOf(int fd) {
  char text[300];
  const ssize_t n = pread(fd, text, sizeof(text), 0);
  std::string holder(text, n > 0 ? static_cast<size_t>(n) : 0);
  holder.resize(std::min(holder.find('\n'), holder.size()));
  for (char& c : holder) c = absl::ascii_isprint(static_cast<unsigned char>(c)) ? c : '?';
  return holder.empty() ? "another process" : holder;
}

bool SameFile(const ConfinedFolder& folder, int fd) {
  struct stat held, named;
  return fstat(fd, &held) == 0 && lstat(folder.At(ResultLock::kFileName).c_str(), &named) == 0 &&
         held.st_dev == named.st_dev && held.st_ino == named.st_ino;
}

UniqueFd OpenLockFile(const ConfinedFolder& folder) {
  const std::string path = folder.At(ResultLock::kFileName);
  constexpr int kFlags = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  UniqueFd file(open(path.c_str(), O_RDWR | O_CREAT | kFlags, 0666));
  // Left by another user who was killed: reading is enough to lock it.
  if (!file.open() && errno == EACCES) file = UniqueFd(open(path.c_str(), O_RDONLY | kFlags));
  return file;
}

}  // namespace

absl::StatusOr<ResultLock> ResultLock::Acquire(const std::string& out, const std::string& owner,
                                               std::chrono::milliseconds patience) {
  absl::StatusOr<ConfinedFolder> folder = ConfinedFolder::Open(out);
  if (!folder.ok()) return folder.status();
  const Clock::time_point until = Clock::now() + patience;
  for (;;) {
    UniqueFd file = OpenLockFile(*folder);
    if (!file.open()) return WriteError(folder->Named(kFileName), errno);
    if (flock(file.get(), LOCK_EX | LOCK_NB) == 0) {
      // Its last holder may have removed it before it let go.
      if (!SameFile(*folder, file.get())) continue;
      const std::string line = absl::StrCat(InFull(owner), "\n");
      // Only for people; the lock holds without it.
      if (ftruncate(file.get(), 0) == 0) {
        [[maybe_unused]] const ssize_t written = pwrite(file.get(), line.data(), line.size(), 0);
      }
      return ResultLock(*std::move(folder), std::move(file), owner);
    }
    if (errno == EINTR) continue;
    if (errno != EWOULDBLOCK) return ResultLock(*std::move(folder), UniqueFd(), owner);
    if (Clock::now() >= until) {
      return absl::FailedPreconditionError(
          absl::StrCat(out, ": ", HolderOf(file.get()),
                       ", writes to this folder; wait until it has ended, or choose another folder"));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

ResultLock::~ResultLock() {
  if (IsInPlace()) folder_.Remove(kFileName).IgnoreError();
}

bool ResultLock::IsInPlace() const { return file_.open() && SameFile(folder_, file_.get()); }

absl::Status ResultLock::Renew() {
  if (!file_.open()) return absl::OkStatus();
  // The folder may have been removed and made again since it was opened.
  if (const auto now = ConfinedFolder::Open(folder_.path()); now.ok() && SameFile(*now, file_.get())) {
    return absl::OkStatus();
  }
  if (absl::Status status = CreateFolders(folder_.path()); !status.ok()) return status;
  absl::StatusOr<ResultLock> again = Acquire(folder_.path(), owner_, std::chrono::milliseconds(0));
  if (!again.ok()) return again.status();
  *this = *std::move(again);
  return absl::OkStatus();
}

}  // namespace weft
