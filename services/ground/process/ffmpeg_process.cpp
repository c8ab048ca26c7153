#include "services/ground/process/ffmpeg_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

extern char** environ;

namespace weft {
namespace {

constexpr size_t kMostWords = 2000;  // bytes of the program's last words

}  // namespace

std::string VideoRate(int64_t period_ns) {
  return period_ns > 0 ? absl::StrCat("1000000000/", period_ns) : "30";
}

std::string FileArgument(const std::string& path) { return "file:" + path; }

absl::StatusOr<FfmpegProcess> FfmpegProcess::Start(const std::vector<std::string>& arguments) {
  FfmpegProcess process;
  int ends[2] = {-1, -1};
  // A socket instead of a pipe: writing to a program that has ended is an error and no signal.
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    return absl::InternalError(absl::StrCat("no socket for ffmpeg: ", std::strerror(errno)));
  process.pipe_ = ends[0];
  process.errors_ = memfd_create("ffmpeg", MFD_CLOEXEC);
  if (process.errors_ < 0) {
    close(ends[1]);
    return absl::InternalError(absl::StrCat("no memory file for ffmpeg: ", std::strerror(errno)));
  }
  std::vector<std::string> words = {"ffmpeg", "-hide_banner", "-loglevel", "error", "-nostdin", "-y"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, process.errors_, STDERR_FILENO);
  const int failure = posix_spawnp(&process.pid_, "ffmpeg", &files, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  close(ends[1]);
  if (failure == 0) return process;
  process.pid_ = -1;
  return absl::NotFoundError(absl::StrCat("the program ffmpeg does not start: ", std::strerror(failure),
                                          "; install the package ffmpeg"));
}

FfmpegProcess::FfmpegProcess(FfmpegProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      pipe_(std::exchange(other.pipe_, -1)),
      errors_(std::exchange(other.errors_, -1)) {}

FfmpegProcess::~FfmpegProcess() {
  if (pipe_ >= 0) close(pipe_);
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  if (errors_ >= 0) close(errors_);
}

std::string FfmpegProcess::LastWords() const {
  std::string words(kMostWords, '\0');
  const off_t size = lseek(errors_, 0, SEEK_END);
  const ssize_t got =
      pread(errors_, words.data(), words.size(), std::max<off_t>(0, size - static_cast<off_t>(kMostWords)));
  words.resize(static_cast<size_t>(std::max<ssize_t>(0, got)));
  return std::string(absl::StripAsciiWhitespace(words));
}

absl::Status FfmpegProcess::Write(const void* bytes, size_t size) {
  const auto* at = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t sent = send(pipe_, at, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return absl::InternalError(absl::StrCat("ffmpeg ended early: ", LastWords()));
    at += sent;
    size -= static_cast<size_t>(sent);
  }
  return absl::OkStatus();
}

absl::Status FfmpegProcess::Read(void* bytes, size_t size) {
  auto* at = static_cast<char*>(bytes);
  while (size > 0) {
    const ssize_t got = recv(pipe_, at, size, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return absl::OutOfRangeError(absl::StrCat("ffmpeg has no more: ", LastWords()));
    at += got;
    size -= static_cast<size_t>(got);
  }
  return absl::OkStatus();
}

absl::Status FfmpegProcess::Finish() {
  shutdown(pipe_, SHUT_RDWR);  // also where it has more to say than was asked for
  int state = 0;
  while (waitpid(pid_, &state, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  if (WIFEXITED(state) && WEXITSTATUS(state) == 0) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("ffmpeg failed: ", LastWords()));
}

}  // namespace weft
