// Preloaded into any program (LD_PRELOAD), takes its disk away at the boundary of system calls and writes
// down what it did there: the program's own code is unchanged. Seen are open, creat, write, pwrite, writev,
// pwritev (also their 64-bit names), fsync, fdatasync, fallocate, ftruncate, rename, unlink, mkdir and rmdir;
// not seen are stdio's own writes (fwrite) and memory maps.
//
// Of which calls all of this speaks:
//   WEFT_FAULT_UNDER=TEXT    only files whose path contains TEXT; without it those with ".stream" in theirs
//   WEFT_FAULT_PROGRAM=NAME  only in the program of this name; others that inherit the environment go free
// A disk that is slow, full or broken:
//   WEFT_FAULT_STALL=FILE    writes and flushes hang for as long as FILE exists
//   WEFT_FAULT_FULL=BYTES    after so many bytes pwritev answers ENOSPC
//   WEFT_FAULT_ERROR=BYTES   after so many bytes pwritev answers EIO
// One call that fails:
//   WEFT_FAULT_NTH=N         the Nth of the calls (from 1; each process counts its own) goes wrong
//   WEFT_FAULT_CALLS=LIST    which calls count: write, sync, fallocate, truncate, rename, open, unlink,
//   mkdir,
//                            separated by commas; without it the first five. `write` is every kind of write,
//                            `sync` fsync and fdatasync, `open` what makes a new file
//   WEFT_FAULT_HOW=WORD      error (the call fails and does nothing; the default), torn (half of a write gets
//                            through, then it fails), kill (SIGKILL before the call), kill_torn
//   WEFT_FAULT_ERRNO=NUMBER  what it answers; without it 5, EIO (28: ENOSPC)
//   WEFT_FAULT_ONWARDS=1     all calls after it fail too
//   WEFT_FAULT_COUNT=FILE    gets a byte for each call that counts, so that a run without a fault tells how
//   many
// What the program did, from which tests/system/crash_states.py rebuilds the disk of a crash:
//   WEFT_FAULT_LOG=FILE      a line per call that succeeded, tabs between its fields: call, process, offset,
//   size,
//                            path, second path; after the line of a write its bytes. Writes to standard
//                            output are there as `said`. Calls of one process follow each other while this is
//                            on.
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <vector>

namespace {

std::atomic<unsigned long long> written_bytes{0};
std::atomic<unsigned long long> calls{0};
std::mutex log_mutex;

template <typename Function>
Function Next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

unsigned long long NumberOf(const char* variable) {
  const char* text = std::getenv(variable);
  return text == nullptr ? 0 : std::strtoull(text, nullptr, 10);
}

std::string PathOf(int fd) {
  char link[64], path[4096];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t size = readlink(link, path, sizeof path - 1);
  return size < 0 ? "" : std::string(path, static_cast<size_t>(size));
}

std::string AbsolutePath(int folder, const char* path) {
  // A file reached through an open folder.
  static const std::string kThroughFd = "/proc/self/fd/";
  if (std::strncmp(path, kThroughFd.c_str(), kThroughFd.size()) == 0) {
    char* rest = nullptr;
    const long fd = std::strtol(path + kThroughFd.size(), &rest, 10);
    return PathOf(static_cast<int>(fd)) + rest;
  }
  if (path[0] == '/') return path;
  char here[4096];
  const std::string base = folder != AT_FDCWD ? PathOf(folder) : getcwd(here, sizeof here) ? here : "";
  return base + "/" + path;
}

bool IsOurs(const std::string& path) {
  const char* program = std::getenv("WEFT_FAULT_PROGRAM");
  if (program != nullptr && std::strcmp(program, program_invocation_short_name) != 0) return false;
  const char* under = std::getenv("WEFT_FAULT_UNDER");
  return path.find(under == nullptr ? ".stream" : under) != std::string::npos;
}

void WaitWhileStalled() {
  const char* file = std::getenv("WEFT_FAULT_STALL");
  while (file != nullptr && access(file, F_OK) == 0) usleep(2000);
}

bool IsBeyond(const char* variable) {
  return std::getenv(variable) != nullptr && written_bytes > NumberOf(variable);
}

bool Counts(const char* kind) {
  const char* list = std::getenv("WEFT_FAULT_CALLS");
  const std::string all = std::string(",") + (list ? list : "write,sync,fallocate,truncate,rename") + ",";
  return all.find(std::string(",") + kind + ",") != std::string::npos;
}

// The call of this kind goes wrong, with errno set.
bool Fails(const char* kind) {
  if (!Counts(kind)) return false;
  const unsigned long long number = ++calls;
  if (const char* count = std::getenv("WEFT_FAULT_COUNT")) {
    const long fd = syscall(SYS_openat, AT_FDCWD, count, O_WRONLY | O_CREAT | O_APPEND, 0644);
    syscall(SYS_write, fd, ".", 1);
    syscall(SYS_close, fd);
  }
  const unsigned long long nth = NumberOf("WEFT_FAULT_NTH");
  if (nth == 0 || number < nth || (number > nth && NumberOf("WEFT_FAULT_ONWARDS") == 0)) return false;
  const unsigned long long answer = NumberOf("WEFT_FAULT_ERRNO");
  errno = answer == 0 ? EIO : static_cast<int>(answer);
  return true;
}

bool How(const char* word) {
  const char* how = std::getenv("WEFT_FAULT_HOW");
  return how != nullptr && std::strcmp(how, word) == 0;
}

// What a call that goes wrong and writes nothing does.
int GoWrong() {
  if (How("kill") || How("kill_torn")) kill(getpid(), SIGKILL);
  return -1;
}

bool IsLogged() { return std::getenv("WEFT_FAULT_LOG") != nullptr; }

// One record, in one piece.
void Log(const char* call, long long offset, size_t size, const std::string& path, const std::string& second,
         const std::vector<iovec>& bytes = {}) {
  if (!IsLogged()) return;
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "\t%d\t%lld\t%zu\t", getpid(), offset, size);
  std::string record = call + std::string(numbers) + path + "\t" + second + "\n";
  size_t left = bytes.empty() ? 0 : size;
  for (const iovec& piece : bytes) {
    const size_t part = left < piece.iov_len ? left : piece.iov_len;
    record.append(static_cast<const char*>(piece.iov_base), part);
    left -= part;
  }
  const long fd =
      syscall(SYS_openat, AT_FDCWD, std::getenv("WEFT_FAULT_LOG"), O_WRONLY | O_CREAT | O_APPEND, 0644);
  syscall(SYS_write, fd, record.data(), record.size());
  syscall(SYS_close, fd);
}

// Calls of a process follow each other while they are logged.
class Turn {
 public:
  Turn() {
    if (IsLogged()) log_mutex.lock(), locked_ = true;
  }
  ~Turn() {
    const int keep = errno;
    if (locked_) log_mutex.unlock();
    errno = keep;
  }

 private:
  bool locked_ = false;
};

long long PlaceOf(int fd) {
  if ((fcntl(fd, F_GETFL) & O_APPEND) == 0) return lseek(fd, 0, SEEK_CUR);
  struct stat info {};
  return fstat(fd, &info) == 0 ? info.st_size : 0;
}

// Every kind of write. `at` below 0: where the file stands. `next` does the call with these pieces.
template <typename Call>
ssize_t Write(int fd, std::vector<iovec> pieces, long long at, bool has_limits, Call next) {
  const std::string path = PathOf(fd);
  if (fd == STDOUT_FILENO || !IsOurs(path)) {
    const Turn turn;
    const ssize_t n = next(pieces);
    if (fd == STDOUT_FILENO && n > 0) Log("said", 0, static_cast<size_t>(n), "", "", pieces);
    return n;
  }
  WaitWhileStalled();
  const Turn turn;
  const long long offset = at >= 0 ? at : PlaceOf(fd);
  std::vector<iovec> half = pieces;
  if (half.size() > 1) half.resize(1);
  const auto log = [&](ssize_t n) {
    if (n > 0) Log("write", offset, static_cast<size_t>(n), path, "", pieces);
    return n;
  };
  if (Fails("write")) {
    const int answer = errno;
    if (pieces.size() == 1) half[0].iov_len /= 2;
    if (How("torn") || How("kill_torn")) log(next(half));
    GoWrong();
    errno = answer;
    return -1;
  }
  for (const iovec& piece : pieces) written_bytes += piece.iov_len;
  if (has_limits && (IsBeyond("WEFT_FAULT_FULL") || IsBeyond("WEFT_FAULT_ERROR"))) {
    if (pieces.size() > 1) log(next(half));  // a part gets through, as on a real disk
    errno = IsBeyond("WEFT_FAULT_FULL") ? ENOSPC : EIO;
    return -1;
  }
  return log(next(pieces));
}

// Every other call on a file that is open.
template <typename Call>
int OnFile(int fd, const char* kind, long long offset, size_t size, Call next) {
  const std::string path = PathOf(fd);
  if (!IsOurs(path)) return next();
  if (std::strcmp(kind, "sync") == 0) WaitWhileStalled();
  const Turn turn;
  if (Fails(kind)) return GoWrong();
  const int result = next();
  if (result == 0) Log(kind, offset, size, path, "");
  return result;
}

template <typename Call>
int OnName(const char* kind, const std::string& path, const std::string& second, Call next) {
  if (!IsOurs(path) && (second.empty() || !IsOurs(second))) return next();
  const Turn turn;
  if (Fails(kind)) return GoWrong();
  const int result = next();
  if (result >= 0) Log(kind, 0, 0, path, second);
  return result;
}

template <typename Call>
int Open(int folder, const char* path, int flags, Call next) {
  const std::string whole = AbsolutePath(folder, path);
  if ((flags & (O_CREAT | O_TRUNC)) == 0 || (flags & O_TMPFILE) == O_TMPFILE || !IsOurs(whole)) return next();
  struct stat info {};
  const bool is_new = stat(whole.c_str(), &info) != 0;
  if (is_new) return OnName("open", whole, "", next);
  const Turn turn;
  const int fd = next();
  if (fd >= 0 && (flags & O_TRUNC) != 0) Log("truncate", 0, 0, whole, "");
  return fd;
}

mode_t ModeOf(int flags, va_list list) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? static_cast<mode_t>(va_arg(list, int)) : 0;
}

}  // namespace

#define WEFT_OPEN(name)                                                          \
  extern "C" int name(const char* path, int flags, ...) {                        \
    static const auto next = Next<int (*)(const char*, int, mode_t)>(#name);     \
    va_list list;                                                                \
    va_start(list, flags);                                                       \
    const mode_t mode = ModeOf(flags, list);                                     \
    va_end(list);                                                                \
    return Open(AT_FDCWD, path, flags, [&] { return next(path, flags, mode); }); \
  }
#define WEFT_OPENAT(name)                                                              \
  extern "C" int name(int folder, const char* path, int flags, ...) {                  \
    static const auto next = Next<int (*)(int, const char*, int, mode_t)>(#name);      \
    va_list list;                                                                      \
    va_start(list, flags);                                                             \
    const mode_t mode = ModeOf(flags, list);                                           \
    va_end(list);                                                                      \
    return Open(folder, path, flags, [&] { return next(folder, path, flags, mode); }); \
  }
#define WEFT_PWRITE(name)                                                               \
  extern "C" ssize_t name(int fd, const void* bytes, size_t size, off_t offset) {       \
    static const auto next = Next<ssize_t (*)(int, const void*, size_t, off_t)>(#name); \
    return Write(fd, {{const_cast<void*>(bytes), size}}, offset, false,                 \
                 [&](const std::vector<iovec>& pieces) {                                \
                   return next(fd, pieces[0].iov_base, pieces[0].iov_len, offset);      \
                 });                                                                    \
  }
#define WEFT_PWRITEV(name)                                                                         \
  extern "C" ssize_t name(int fd, const iovec* pieces, int count, off_t offset) {                  \
    static const auto next = Next<ssize_t (*)(int, const iovec*, int, off_t)>(#name);              \
    return Write(fd, {pieces, pieces + count}, offset, true, [&](const std::vector<iovec>& some) { \
      return next(fd, some.data(), static_cast<int>(some.size()), offset);                         \
    });                                                                                            \
  }
#define WEFT_FALLOCATE(name)                                               \
  extern "C" int name(int fd, int mode, off_t offset, off_t size) {        \
    static const auto next = Next<int (*)(int, int, off_t, off_t)>(#name); \
    return OnFile(fd, "fallocate", offset, static_cast<size_t>(size),      \
                  [&] { return next(fd, mode, offset, size); });           \
  }
#define WEFT_FTRUNCATE(name)                                                                     \
  extern "C" int name(int fd, off_t size) noexcept {                                             \
    static const auto next = Next<int (*)(int, off_t)>(#name);                                   \
    return OnFile(fd, "truncate", 0, static_cast<size_t>(size), [&] { return next(fd, size); }); \
  }
WEFT_OPEN(open)
WEFT_OPEN(open64)
WEFT_OPENAT(openat)
WEFT_OPENAT(openat64)
WEFT_PWRITE(pwrite)
WEFT_PWRITE(pwrite64)
WEFT_PWRITEV(pwritev)
WEFT_PWRITEV(pwritev64)
WEFT_FALLOCATE(fallocate)
WEFT_FALLOCATE(fallocate64)
WEFT_FTRUNCATE(ftruncate)
WEFT_FTRUNCATE(ftruncate64)

extern "C" ssize_t write(int fd, const void* bytes, size_t size) {
  static const auto next = Next<ssize_t (*)(int, const void*, size_t)>("write");
  return Write(fd, {{const_cast<void*>(bytes), size}}, -1, false, [&](const std::vector<iovec>& pieces) {
    return next(fd, pieces[0].iov_base, pieces[0].iov_len);
  });
}

extern "C" ssize_t writev(int fd, const iovec* pieces, int count) {
  static const auto next = Next<ssize_t (*)(int, const iovec*, int)>("writev");
  return Write(fd, {pieces, pieces + count}, -1, false, [&](const std::vector<iovec>& some) {
    return next(fd, some.data(), static_cast<int>(some.size()));
  });
}

extern "C" int fdatasync(int fd) {
  static const auto next = Next<int (*)(int)>("fdatasync");
  return OnFile(fd, "sync", 0, 0, [&] { return next(fd); });
}

extern "C" int fsync(int fd) {
  static const auto next = Next<int (*)(int)>("fsync");
  return OnFile(fd, "sync", 0, 0, [&] { return next(fd); });
}

extern "C" int rename(const char* from, const char* to) noexcept {
  static const auto next = Next<int (*)(const char*, const char*)>("rename");
  return OnName("rename", AbsolutePath(AT_FDCWD, from), AbsolutePath(AT_FDCWD, to),
                [&] { return next(from, to); });
}

extern "C" int renameat(int from_folder, const char* from, int to_folder, const char* to) noexcept {
  static const auto next = Next<int (*)(int, const char*, int, const char*)>("renameat");
  return OnName("rename", AbsolutePath(from_folder, from), AbsolutePath(to_folder, to),
                [&] { return next(from_folder, from, to_folder, to); });
}

extern "C" int unlink(const char* path) noexcept {
  static const auto next = Next<int (*)(const char*)>("unlink");
  return OnName("unlink", AbsolutePath(AT_FDCWD, path), "", [&] { return next(path); });
}

extern "C" int remove(const char* path) noexcept {
  static const auto next = Next<int (*)(const char*)>("remove");
  return OnName("unlink", AbsolutePath(AT_FDCWD, path), "", [&] { return next(path); });
}

extern "C" int unlinkat(int folder, const char* path, int flags) noexcept {
  static const auto next = Next<int (*)(int, const char*, int)>("unlinkat");
  return OnName("unlink", AbsolutePath(folder, path), "", [&] { return next(folder, path, flags); });
}

extern "C" int mkdir(const char* path, mode_t mode) noexcept {
  static const auto next = Next<int (*)(const char*, mode_t)>("mkdir");
  return OnName("mkdir", AbsolutePath(AT_FDCWD, path), "", [&] { return next(path, mode); });
}

extern "C" int mkdirat(int folder, const char* path, mode_t mode) noexcept {
  static const auto next = Next<int (*)(int, const char*, mode_t)>("mkdirat");
  return OnName("mkdir", AbsolutePath(folder, path), "", [&] { return next(folder, path, mode); });
}

extern "C" int rmdir(const char* path) noexcept {
  static const auto next = Next<int (*)(const char*)>("rmdir");
  return OnName("unlink", AbsolutePath(AT_FDCWD, path), "", [&] { return next(path); });
}
