// Preloaded into a recorder, takes its disk away at the boundary of system calls: the recorder's own code is
// unchanged.
//   WEFT_FAULT_STALL=FILE   writes and flushes of streams hang for as long as FILE exists
//   WEFT_FAULT_FULL=BYTES   after so many bytes the streams' disk is full
//   WEFT_FAULT_ERROR=BYTES  after so many bytes it answers EIO
#include <dlfcn.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

std::atomic<unsigned long long> written_bytes{0};

template <typename Function>
Function Next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

bool IsStream(int fd) {
  char link[64], path[4096];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t size = readlink(link, path, sizeof path - 1);
  if (size < 0) return false;
  path[size] = 0;
  return std::strstr(path, ".stream") != nullptr;
}

void WaitWhileStalled() {
  const char* file = std::getenv("WEFT_FAULT_STALL");
  while (file != nullptr && access(file, F_OK) == 0) usleep(2000);
}

bool IsBeyond(const char* variable) {
  const char* limit = std::getenv(variable);
  return limit != nullptr && written_bytes > std::strtoull(limit, nullptr, 10);
}

}  // namespace

extern "C" ssize_t pwritev(int fd, const iovec* pieces, int count, off_t offset) {
  static const auto next = Next<ssize_t (*)(int, const iovec*, int, off_t)>("pwritev");
  if (!IsStream(fd)) return next(fd, pieces, count, offset);
  WaitWhileStalled();
  for (int i = 0; i < count; ++i) written_bytes += pieces[i].iov_len;
  if (IsBeyond("WEFT_FAULT_FULL") || IsBeyond("WEFT_FAULT_ERROR")) {
    // A part gets through, as on a real disk.
    if (count > 1) next(fd, pieces, 1, offset);
    errno = IsBeyond("WEFT_FAULT_FULL") ? ENOSPC : EIO;
    return -1;
  }
  return next(fd, pieces, count, offset);
}

extern "C" int fdatasync(int fd) {
  static const auto next = Next<int (*)(int)>("fdatasync");
  if (IsStream(fd)) WaitWhileStalled();
  return next(fd);
}
