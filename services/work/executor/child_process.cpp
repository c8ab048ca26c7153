#include "services/work/executor/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "base/error_reason.h"
#include "base/status_macros.h"
#include "services/ground/process/child_environment.h"

namespace weft {
namespace {

// Attributes and file actions of posix_spawn, freed when they go out of scope.
class SpawnSettings {
 public:
  SpawnSettings() {
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_init(&actions);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  // 0, or errno.
  int Configure(int out_write, int err_write, const ChildSettings& settings) {
    sigset_t none, defaults;
    sigemptyset(&none);
    sigemptyset(&defaults);
    for (const int signal : {SIGPIPE, SIGTERM, SIGINT, SIGHUP, SIGCHLD}) sigaddset(&defaults, signal);
    const char* const input = settings.input.empty() ? "/dev/null" : settings.input.c_str();
    const short flags = POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF;
    for (const int error :
         {posix_spawnattr_setflags(&attributes, flags), posix_spawnattr_setpgroup(&attributes, 0),
          posix_spawnattr_setsigmask(&attributes, &none),
          posix_spawnattr_setsigdefault(&attributes, &defaults),
          posix_spawn_file_actions_addopen(&actions, 0, input, O_RDONLY, 0),
          posix_spawn_file_actions_adddup2(&actions, out_write, 1),
          posix_spawn_file_actions_adddup2(&actions, err_write, 2),
          posix_spawn_file_actions_addclosefrom_np(&actions, 3)}) {
      if (error != 0) return error;
    }
    if (settings.folder.empty()) return 0;
    return posix_spawn_file_actions_addchdir_np(&actions, settings.folder.c_str());
  }

  posix_spawnattr_t attributes;
  posix_spawn_file_actions_t actions;
};

absl::Status SpawnError(const std::string& program, int error) {
  const std::string message = absl::StrCat(program, ": cannot be started (", strerror(error), ")");
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return absl::NotFoundError(message);
    case EACCES:
    case EPERM:
    case ENOEXEC:
      return absl::PermissionDeniedError(message);
    case EAGAIN:
      return WithReason(absl::ResourceExhaustedError(message), ErrorReason::kNoFreeThread);
    default:
      return absl::ResourceExhaustedError(message);
  }
}

// A pipe whose reading end does not block.
int MakePipe(UniqueFd& reading, UniqueFd& writing) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return errno;
  reading = UniqueFd(ends[0]);
  writing = UniqueFd(ends[1]);
  return fcntl(ends[0], F_SETFL, O_NONBLOCK) == 0 ? 0 : errno;
}

}  // namespace

std::vector<std::string> LineSplitter::Add(std::string_view bytes) {
  std::vector<std::string> lines;
  while (!bytes.empty()) {
    const size_t end = bytes.find('\n');
    const std::string_view piece = bytes.substr(0, end);
    if (!cutting_) rest_.append(piece.substr(0, kMaxLineBytes - rest_.size()));
    cutting_ = rest_.size() >= kMaxLineBytes;
    if (end == std::string_view::npos) break;
    lines.push_back(TakeRest());
    bytes.remove_prefix(end + 1);
  }
  return lines;
}

std::string LineSplitter::TakeRest() {
  cutting_ = false;
  std::string rest;
  rest.swap(rest_);
  return rest;
}

absl::StatusOr<ChildProcess> ChildProcess::Spawn(const std::string& program,
                                                 const std::vector<std::string>& arguments,
                                                 const ChildSettings& child_settings) {
  ChildProcess child;
  UniqueFd out_write, err_write;
  if (const int error = MakePipe(child.out_, out_write)) return SpawnError(program, error);
  if (const int error = MakePipe(child.err_, err_write)) return SpawnError(program, error);
  SpawnSettings settings;
  if (const int error = settings.Configure(out_write.get(), err_write.get(), child_settings))
    return SpawnError(program, error);
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  std::vector<std::string> environment;
  std::vector<char*> variables;
  if (child_settings.hides_secrets) environment = EnvironmentWithoutSecrets();
  for (std::string& variable : environment) variables.push_back(variable.data());
  variables.push_back(nullptr);
  pid_t pid = -1;
  if (const int error = posix_spawn(&pid, program.c_str(), &settings.actions, &settings.attributes,
                                    argv.data(), child_settings.hides_secrets ? variables.data() : environ)) {
    return SpawnError(program, error);
  }
  child.pid_ = pid;
  child.exit_ = UniqueFd(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
  if (!child.exit_.open()) return SpawnError(program, errno);
  if (child_settings.record_folder.empty()) return child;
  WEFT_ASSIGN_OR_RETURN(child.record_, ProcessRecord::Make(child_settings.record_folder, pid));
  return child;
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(other.pid_),
      out_(std::move(other.out_)),
      err_(std::move(other.err_)),
      exit_(std::move(other.exit_)),
      record_(std::move(other.record_)) {
  other.pid_ = -1;
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) Reap();
}

std::string ChildProcess::ReadAvailable(UniqueFd& fd) {
  constexpr size_t kMostBytes = size_t{1} << 20;  // then the others' turn
  std::string bytes;
  char buffer[16384];
  while (fd.open() && bytes.size() < kMostBytes) {
    const ssize_t n = read(fd.get(), buffer, sizeof(buffer));
    if (n > 0) {
      bytes.append(buffer, static_cast<size_t>(n));
    } else if (n == 0 || (errno != EINTR && errno != EAGAIN)) {
      fd.Close();
    } else if (errno == EAGAIN) {
      break;
    }
  }
  return bytes;
}

void ChildProcess::Signal(int signal) const {
  if (pid_ > 0) kill(-pid_, signal);
}

int ChildProcess::Reap() {
  Signal(SIGKILL);
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  record_ = {};
  return status;
}

}  // namespace weft
