#include "services/studio/video/video_program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "services/ground/process/program_beside.h"

extern char** environ;

namespace weft {
namespace {

constexpr int kPixelsTimeout_ms = 60'000;  // for pixels
constexpr std::chrono::seconds kSilence{120};
constexpr rlim_t kMostSaid = rlim_t{512} << 20;  // as weft-video allows
constexpr useconds_t kLook_us = 50'000;

absl::Status SystemError(const char* what, int error) {
  return absl::ResourceExhaustedError(absl::StrCat("weft-video: ", what, ": ", std::strerror(error)));
}

size_t SizeOf(const UniqueFd& file) {
  return static_cast<size_t>(std::max<off_t>(0, lseek(file.get(), 0, SEEK_END)));
}

std::string ReadAll(const UniqueFd& file, size_t most) {
  std::string text(std::min(SizeOf(file), most), '\0');
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

// Descriptors of the new process, in order from 0; -1: none.
int Spawn(const std::vector<std::string>& words, const std::vector<int>& descriptors, pid_t* pid) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  for (size_t i = 0; i < descriptors.size(); ++i)
    posix_spawn_file_actions_adddup2(&files, descriptors[i], static_cast<int>(i) + 1);
  posix_spawn_file_actions_addclosefrom_np(&files, static_cast<int>(descriptors.size()) + 1);
  // A group of its own: Ctrl-C is for us, and we end it.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const int error = posix_spawn(pid, argv[0], &files, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  return error;
}

// What is said goes to files in memory, to which the limit on the size of files applies: beyond it words are
// lost without one of that.
bool IsBeyondFileSize(size_t size) {
  rlimit limit = {};
  return getrlimit(RLIMIT_FSIZE, &limit) == 0 && size >= std::min<rlim_t>(limit.rlim_cur, kMostSaid);
}

// A descriptor above those that Spawn places, which may otherwise cover each other.
UniqueFd MemoryFile() {
  const UniqueFd low(memfd_create("weft-video", MFD_CLOEXEC));
  return UniqueFd(low.open() ? fcntl(low.get(), F_DUPFD_CLOEXEC, 10) : -1);
}

}  // namespace

absl::StatusOr<VideoProgram> VideoProgram::Start(const std::string& program, const std::string& file,
                                                 const std::vector<std::string>& arguments, Out out) {
  const std::string confiner = ProgramBeside("weft-video");
  if (access(confiner.c_str(), X_OK) != 0)
    return absl::FailedPreconditionError(
        "weft-video, which reads videos, is not installed beside this program; install Weft again");
  VideoProgram started;
  started.kept_ = MemoryFile();
  started.errors_ = MemoryFile();
  if (!started.kept_.open() || !started.errors_.open()) return SystemError("no memory file", errno);
  UniqueFd end;
  if (out == Out::kPipe) {
    int ends[2] = {-1, -1};
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return SystemError("no socket", errno);
    started.pipe_ = UniqueFd(ends[0]);
    end = UniqueFd(fcntl(ends[1], F_DUPFD_CLOEXEC, 10));
    close(ends[1]);
  }
  std::vector<std::string> words = {confiner, "--parent", absl::StrCat(getpid()), file, program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const int standard_out = out == Out::kPipe ? end.get() : started.kept_.get();
  const int error = Spawn(words, {standard_out, started.errors_.get(), started.kept_.get()}, &started.pid_);
  if (error == 0) return started;
  started.pid_ = -1;
  return SystemError("cannot start", error);
}

VideoProgram::VideoProgram(VideoProgram&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      pipe_(std::move(other.pipe_)),
      kept_(std::move(other.kept_)),
      errors_(std::move(other.errors_)) {}

VideoProgram::~VideoProgram() { Kill(); }

void VideoProgram::Kill() {
  if (pid_ <= 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

absl::Status VideoProgram::Read(void* bytes, size_t size) {
  auto* at = static_cast<char*>(bytes);
  while (size > 0) {
    pollfd ready = {pipe_.get(), POLLIN, 0};
    const int polled = poll(&ready, 1, kPixelsTimeout_ms);
    if (polled < 0 && errno == EINTR) continue;
    if (polled == 0) return absl::DeadlineExceededError("ffmpeg made no progress for a minute");
    const ssize_t got = recv(pipe_.get(), at, size, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return absl::OutOfRangeError("no more frames");
    at += got;
    size -= static_cast<size_t>(got);
  }
  return absl::OkStatus();
}

absl::StatusOr<VideoProgramOutput> VideoProgram::Finish(const std::function<bool(size_t bytes)>& grown) {
  VideoProgramOutput said;
  size_t known = 0;
  auto last = std::chrono::steady_clock::now();
  pipe_.Close();
  for (;;) {
    const pid_t ended = waitpid(pid_, &said.wait_status, WNOHANG);
    if (ended == pid_) break;
    if (ended < 0 && errno != EINTR) return SystemError("its end is unknown", errno);
    const size_t size = SizeOf(kept_) + SizeOf(errors_);
    if (size != known) last = std::chrono::steady_clock::now();
    known = size;
    if (grown && !grown(SizeOf(kept_))) {
      Kill();
      return absl::CancelledError("stopped");
    }
    if (std::chrono::steady_clock::now() - last > kSilence) {
      Kill();
      return absl::DeadlineExceededError("ffmpeg made no progress for two minutes");
    }
    usleep(kLook_us);
  }
  pid_ = -1;
  if (IsBeyondFileSize(SizeOf(kept_)) || IsBeyondFileSize(SizeOf(errors_)))
    return absl::ResourceExhaustedError(
        "ffmpeg says more of it than files may hold; raise the limit on the size of files (ulimit -f), or "
        "cut "
        "the film into parts");
  said.out = ReadAll(kept_, SIZE_MAX);
  said.errors = ReadAll(errors_, SIZE_MAX);
  return said;
}

absl::StatusOr<VideoProgramOutput> RunVideoProgram(const std::string& program, const std::string& file,
                                                   const std::vector<std::string>& arguments,
                                                   const std::function<bool(size_t bytes)>& grown) {
  WEFT_ASSIGN_OR_RETURN(VideoProgram started,
                        VideoProgram::Start(program, file, arguments, VideoProgram::Out::kKept));
  absl::StatusOr<VideoProgramOutput> said = started.Finish(grown);
  if (said.ok()) return said;
  return absl::Status(said.status().code(), absl::StrCat(file, ": ", said.status().message()));
}

std::string LastComplaint(const std::string& errors) {
  std::string last;
  for (absl::string_view line : absl::StrSplit(errors, '\n')) {
    line = absl::StripAsciiWhitespace(line);
    for (size_t end = line.find("] "); !line.empty() && line.front() == '[' && end != absl::string_view::npos;
         end = line.find("] "))
      line.remove_prefix(end + 2);
    if (!line.empty()) last = std::string(line);
  }
  return last;
}

}  // namespace weft
