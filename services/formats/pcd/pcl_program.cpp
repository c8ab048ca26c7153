#include "services/formats/pcd/pcl_program.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/unique_fd.h"

extern char** environ;

namespace weft {
namespace {

constexpr char kRemedy[] =
    "this installation of Weft has no PCL (weft-pcl): install the package weft-pcl, or libpcl-dev and build "
    "again; PLY needs neither";

std::string ProgramPath() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "" : (self.parent_path() / "weft-pcl").string();
}

absl::Status SystemError(const char* what, int error) {
  return absl::ResourceExhaustedError(absl::StrCat("weft-pcl: ", what, ": ", std::strerror(error)));
}

// Files in memory: the process needs no folder, and its output has an end only when it has ended.
struct Streams {
  UniqueFd in, out, errors;

  absl::Status Open(std::string_view input) {
    for (UniqueFd* fd : {&in, &out, &errors}) {
      *fd = UniqueFd(memfd_create("weft-pcl", MFD_CLOEXEC));
      if (!fd->open()) return SystemError("no memory file", errno);
    }
    if (const int error = WriteAll(in.get(), input)) return SystemError("its input cannot be stored", error);
    lseek(in.get(), 0, SEEK_SET);
    return absl::OkStatus();
  }
};

absl::StatusOr<std::string> ReadAll(const UniqueFd& file) {
  std::string bytes(static_cast<size_t>(std::max<off_t>(0, lseek(file.get(), 0, SEEK_END))), '\0');
  for (size_t at = 0; at < bytes.size();) {
    const ssize_t n = pread(file.get(), bytes.data() + at, bytes.size() - at, static_cast<off_t>(at));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return SystemError("its output cannot be read", errno);
    at += static_cast<size_t>(n);
  }
  return bytes;
}

// 0, or errno.
int Spawn(const std::string& program, const std::string& task, const Streams& streams, pid_t* pid) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, streams.in.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, streams.out.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, streams.errors.get(), STDERR_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  const std::string parent = absl::StrCat(getpid());
  std::vector<char*> argv;
  for (const std::string* word : {&program, &task, &parent}) argv.push_back(const_cast<char*>(word->c_str()));
  argv.push_back(nullptr);
  const int error = posix_spawn(pid, program.c_str(), &files, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  return error;
}

// The last line of what it said: that is why it gave up.
std::string LastLine(const UniqueFd& errors) {
  const absl::StatusOr<std::string> text = ReadAll(errors);
  if (!text.ok()) return "";
  const std::vector<std::string> lines =
      absl::StrSplit(absl::StripAsciiWhitespace(*text), '\n', absl::SkipWhitespace());
  return lines.empty() ? "" : std::string(absl::StripAsciiWhitespace(lines.back()));
}

}  // namespace

absl::Status CheckPclProgram() {
  if (access(ProgramPath().c_str(), X_OK) == 0) return absl::OkStatus();
  return absl::FailedPreconditionError(kRemedy);
}

absl::StatusOr<std::string> RunPclProgram(const std::string& task, std::string_view input,
                                          const std::string& source_name) {
  if (!CheckPclProgram().ok()) {
    return absl::FailedPreconditionError(absl::StrCat(source_name, ": is PCD, and ", kRemedy));
  }
  Streams streams;
  WEFT_RETURN_IF_ERROR(streams.Open(input));
  pid_t pid = -1;
  if (const int error = Spawn(ProgramPath(), task, streams, &pid)) return SystemError("cannot start", error);
  int ended = 0;
  while (waitpid(pid, &ended, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(ended) && WEXITSTATUS(ended) == kExitDone) return ReadAll(streams.out);
  const std::string why = LastLine(streams.errors);
  if (WIFEXITED(ended) && WEXITSTATUS(ended) == kExitBadInput) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", why));
  }
  return absl::InternalError(absl::StrCat(source_name, ": PCL failed on it (", DescribeExit(ended),
                                          "); is the file damaged?", why.empty() ? "" : " It said: ", why));
}

}  // namespace weft
