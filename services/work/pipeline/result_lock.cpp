#include "services/work/pipeline/result_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <thread>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"

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

// Only for people; the lock holds without it.
void SayWho(int fd, const std::string& owner) {
  const std::string line = absl::StrCat(InFull(owner), "\n");
  if (ftruncate(fd, 0) == 0) {
    [[maybe_unused]] const ssize_t written = pwrite(fd, line.data(), line.size(), 0);
  }
}

absl::Status HeldBy(const std::string& out, const std::string& holder) {
  return absl::FailedPreconditionError(absl::StrCat(
      out, ": ", holder, ", writes to this folder; wait until it has ended, or choose another folder"));
}

enum class Locked { kYes, kNo, kHasNoLocks };

Locked Lock(int fd) {
  while (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return Locked::kNo;
    if (errno != EINTR) return Locked::kHasNoLocks;
  }
  return Locked::kYes;
}

}  // namespace

absl::StatusOr<ResultLock> ResultLock::Acquire(const std::string& out, const std::string& owner,
                                               std::chrono::milliseconds patience) {
  WEFT_ASSIGN_OR_RETURN(ConfinedFolder folder, ConfinedFolder::Open(out));
  const Clock::time_point until = Clock::now() + patience;
  for (;; std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
    const bool is_last = Clock::now() >= until;
    UniqueFd file = OpenLockFile(folder);
    if (!file.open()) return WriteError(folder.Named(kFileName), errno);
    const Locked locked = Lock(file.get());
    if (locked == Locked::kNo) {
      if (is_last) return HeldBy(out, HolderOf(file.get()));
      continue;
    }
    // Its last holder may have removed it before it let go.
    if (locked == Locked::kYes && !SameFile(folder, file.get())) continue;
    absl::StatusOr<HolderRecord> holder = HolderRecord::TakeIn(folder, kHolderName, owner);
    if (absl::IsFailedPrecondition(holder.status())) {
      if (is_last) return holder.status();
      continue;
    }
    if (locked == Locked::kYes) SayWho(file.get(), owner);
    if (locked == Locked::kHasNoLocks) file.Close();
    // A full disk has no room for it; the other lock holds then.
    std::optional<HolderRecord> record;
    if (holder.ok()) record.emplace(*std::move(holder));
    return ResultLock(std::move(folder), std::move(file), owner, std::move(record));
  }
}

ResultLock::~ResultLock() {
  if (IsInPlace()) folder_.Remove(kFileName).IgnoreError();
}

bool ResultLock::IsInPlace() const { return file_.open() && SameFile(folder_, file_.get()); }

absl::Status ResultLock::Renew() {
  // Where the folder was removed, it is another one's by now, or nobody's.
  if (holder_ && !holder_->IsHeld() && (!file_.open() || IsInPlace())) {
    return absl::FailedPreconditionError(absl::StrCat(
        folder_.path(), ": another process took this folder while this one stood still; run it again"));
  }
  if (!file_.open()) return absl::OkStatus();
  // The folder may have been removed and made again since it was opened.
  if (const auto now = ConfinedFolder::Open(folder_.path()); now.ok() && SameFile(*now, file_.get())) {
    return absl::OkStatus();
  }
  WEFT_RETURN_IF_ERROR(CreateFolders(folder_.path()));
  holder_.reset();
  WEFT_ASSIGN_OR_RETURN(*this, Acquire(folder_.path(), owner_, std::chrono::milliseconds(0)));
  return absl::OkStatus();
}

}  // namespace weft
