#include "services/ground/process/spawned_program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <utility>

extern char** environ;

namespace weft {
namespace {

constexpr int kAboveThoseOfPrograms = 10;

UniqueFd Above(const UniqueFd& low) {
  return UniqueFd(low.open() ? fcntl(low.get(), F_DUPFD_CLOEXEC, kAboveThoseOfPrograms) : -1);
}

}  // namespace

SpawnedProgram::SpawnedProgram(SpawnedProgram&& other) noexcept : pid_(std::exchange(other.pid_, -1)) {}

int SpawnedProgram::Start(const std::vector<std::string>& words, const std::vector<int>& descriptors,
                          bool has_own_group) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (int i = 0; i < static_cast<int>(descriptors.size()); ++i) {
    const int from = descriptors[static_cast<size_t>(i)];
    if (from >= 0) {
      posix_spawn_file_actions_adddup2(&files, from, i);
    } else {
      posix_spawn_file_actions_addopen(&files, i, "/dev/null", O_RDWR, 0);
    }
  }
  posix_spawn_file_actions_addclosefrom_np(&files, static_cast<int>(descriptors.size()));
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  if (has_own_group) {
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
  }
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const int error = posix_spawnp(&pid_, argv[0], &files, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) pid_ = -1;
  return error;
}

int SpawnedProgram::Wait() {
  int status = 0;
  while (pid_ > 0 && waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return status;
}

int SpawnedProgram::Poll(int* status) {
  if (pid_ <= 0) return -1;
  const pid_t ended = waitpid(pid_, status, WNOHANG);
  if (ended < 0) return errno == EINTR ? 0 : -1;
  if (ended > 0) pid_ = -1;
  return ended;
}

void SpawnedProgram::Kill() {
  if (pid_ <= 0) return;
  kill(pid_, SIGKILL);
  Wait();
}

UniqueFd MemoryFile(const char* name) { return Above(UniqueFd(memfd_create(name, MFD_CLOEXEC))); }

size_t SizeOf(const UniqueFd& file) {
  return static_cast<size_t>(std::max<off_t>(0, lseek(file.get(), 0, SEEK_END)));
}

std::string ContentOf(const UniqueFd& file) {
  std::string text(SizeOf(file), '\0');
  size_t read = 0;
  while (read < text.size()) {
    const ssize_t got = pread(file.get(), text.data() + read, text.size() - read, static_cast<off_t>(read));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    read += static_cast<size_t>(got);
  }
  text.resize(read);
  return text;
}

int MakeSocketPair(UniqueFd& ours, UniqueFd& theirs) {
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return errno;
  ours = UniqueFd(ends[0]);
  theirs = Above(UniqueFd(ends[1]));
  return theirs.open() ? 0 : errno;
}

int ReceiveAll(const UniqueFd& socket, void* bytes, size_t size, int timeout_ms) {
  auto* at = static_cast<char*>(bytes);
  while (size > 0) {
    pollfd ready = {socket.get(), POLLIN, 0};
    const int polled = poll(&ready, 1, timeout_ms);
    if (polled < 0 && errno == EINTR) continue;
    if (polled == 0) return ETIMEDOUT;
    const ssize_t got = recv(socket.get(), at, size, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return EPIPE;
    at += got;
    size -= static_cast<size_t>(got);
  }
  return 0;
}

}  // namespace weft
