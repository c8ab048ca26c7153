#include "base/whole_file.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <map>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/mutex.h"

namespace weft {
namespace {

constexpr char kMark[] = ".tmp.";
constexpr size_t kMarkSize = sizeof kMark - 1;
// Where nothing else tells that a writer is gone.
constexpr time_t kOld_s = 60, kOldWithoutLocks_s = 3600;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  int get() const { return fd_; }
  int Close() { return close(std::exchange(fd_, -1)); }

 private:
  int fd_;
};

size_t DigitsAt(std::string_view text) {
  const size_t digits = text.find_first_not_of("0123456789");
  return digits == std::string_view::npos ? text.size() : digits;
}

// The parts of "NAME.tmp.PROCESS.NUMBER"; images of earlier versions have no number.
struct TemporaryName {
  std::string_view file;
  pid_t writer = 0;  // 0: it is no such name
  bool has_number = false;
};

TemporaryName Parse(std::string_view name) {
  const size_t mark = name.rfind(kMark);
  if (mark == std::string_view::npos || mark == 0) return {};
  const std::string_view rest = name.substr(mark + kMarkSize);
  const size_t digits = DigitsAt(rest);
  if (digits == 0 || digits > 9) return {};
  TemporaryName parts{name.substr(0, mark), static_cast<pid_t>(std::atol(std::string(rest).c_str()))};
  const std::string_view number = rest.substr(digits);
  parts.has_number =
      number.size() > 1 && number.front() == '.' && DigitsAt(number.substr(1)) == number.size() - 1;
  return number.empty() || parts.has_number ? parts : TemporaryName();
}

// Its writer locks it as long as it writes. Another machine's may not be seen to, where locks are local.
bool IsOfDead(int fd, pid_t writer) {
  struct stat info;
  if (fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) return false;
  const time_t age_s = time(nullptr) - info.st_mtime;
  const bool is_gone = kill(writer, 0) != 0 && errno == ESRCH;
  if (flock(fd, LOCK_EX | LOCK_NB) == 0) return is_gone || age_s > kOld_s;
  return errno != EWOULDBLOCK && is_gone && age_s > kOldWithoutLocks_s;
}

std::vector<std::string> TemporariesIn(int folder) {
  const int listed = openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(listed >= 0 ? fdopendir(listed) : nullptr, &closedir);
  if (!entries && listed >= 0) close(listed);
  std::vector<std::string> names;
  while (const dirent* entry = entries ? readdir(entries.get()) : nullptr) {
    const pid_t writer = Parse(entry->d_name).writer;
    if (writer != 0 && writer != getpid()) names.emplace_back(entry->d_name);
  }
  return names;
}

// A folder and when it was made, where the file system says so: numbers are given again.
using FolderKey = std::tuple<uint64_t, uint64_t, int64_t, uint32_t>;

bool FindKey(int folder, FolderKey& key) {
  struct statx info = {};
  if (statx(folder, "", AT_EMPTY_PATH, STATX_INO | STATX_BTIME, &info) != 0) return false;
  key = {uint64_t{info.stx_dev_major} << 32 | info.stx_dev_minor, info.stx_ino, info.stx_btime.tv_sec,
         info.stx_btime.tv_nsec};
  return true;
}

// What others had begun in a folder when this process first wrote there: each is listed once.
std::vector<std::string> FoundIn(int folder, const FolderKey& key) {
  constexpr size_t kMostKnown = 256;
  static Mutex mutex;
  // Never destroyed: what lives as long as the program writes files when it ends.
  static auto* const known ABSL_PT_GUARDED_BY(mutex) = new std::map<FolderKey, std::vector<std::string>>();
  const MutexLock lock(mutex);
  if (known->size() >= kMostKnown) known->clear();
  const auto [at, is_new] = known->try_emplace(key);
  if (is_new) at->second = TemporariesIn(folder);
  return at->second;
}

// Of this file alone: other names are not known to be ours.
void RemoveLeftovers(const std::string& folder, std::string_view file) {
  const Descriptor at(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  FolderKey key;
  if (at.get() < 0 || !FindKey(at.get(), key)) return;
  for (const std::string& name : FoundIn(at.get(), key)) {
    const TemporaryName parts = Parse(name);
    if (parts.file != file) continue;
    const Descriptor left(openat(at.get(), name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (left.get() >= 0 && IsOfDead(left.get(), parts.writer)) unlinkat(at.get(), name.c_str(), 0);
  }
}

// A new file that is locked. -1 and errno.
int OpenTemporary(const std::string& path, mode_t mode) {
  for (;;) {
    const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    struct stat info;
    // Whoever removes what others left may have been between the two.
    if (fd < 0 || flock(fd, LOCK_EX | LOCK_NB) != 0 || fstat(fd, &info) != 0 || info.st_nlink > 0) return fd;
    close(fd);
  }
}

int Write(const std::string& temporary, const std::string& path, std::string_view bytes, mode_t mode,
          Flush flush) {
  Descriptor file(OpenTemporary(temporary, mode));
  if (file.get() < 0) return errno;
  int error = WriteAll(file.get(), bytes);
  if (error == 0 && flush == Flush::kToDisk && fsync(file.get()) != 0) error = errno;
  // Some file systems tell of a full disk only here; after a flush they have told.
  if (error == 0 && flush == Flush::kLater && file.Close() != 0) error = errno;
  if (error == 0 && rename(temporary.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) unlink(temporary.c_str());
  return error;
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

bool IsTemporaryName(std::string_view name) {
  const TemporaryName parts = Parse(name);
  return parts.writer != 0 && parts.has_number;
}

int ReplaceWholeFile(const std::string& path, std::string_view bytes, mode_t mode, Flush flush) {
  static std::atomic<uint64_t> counter{0};
  const size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "./" : path.substr(0, slash + 1);
  RemoveLeftovers(folder, std::string_view(path).substr(slash == std::string::npos ? 0 : slash + 1));
  return Write(absl::StrCat(path, kMark, getpid(), ".", counter++), path, bytes, mode, flush);
}

}  // namespace weft
