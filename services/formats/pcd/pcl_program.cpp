#include "services/formats/pcd/pcl_program.h"

#include <sys/wait.h>
#include <unistd.h>

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
#include "services/ground/process/spawned_program.h"

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
      *fd = MemoryFile("weft-pcl");
      if (!fd->open()) return SystemError("no memory file", errno);
    }
    if (const int error = WriteAll(in.get(), input)) return SystemError("its input cannot be stored", error);
    lseek(in.get(), 0, SEEK_SET);
    return absl::OkStatus();
  }
};

// The last line of what it said: that is why it gave up.
std::string LastLine(const UniqueFd& errors) {
  const std::string text = ContentOf(errors);
  const std::vector<std::string> lines =
      absl::StrSplit(absl::StripAsciiWhitespace(text), '\n', absl::SkipWhitespace());
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
  SpawnedProgram program;
  if (const int error = program.Start({ProgramPath(), task, absl::StrCat(getpid())},
                                      {streams.in.get(), streams.out.get(), streams.errors.get()}))
    return SystemError("cannot start", error);
  const int ended = program.Wait();
  if (WIFEXITED(ended) && WEXITSTATUS(ended) == kExitDone) return ContentOf(streams.out);
  const std::string why = LastLine(streams.errors);
  if (WIFEXITED(ended) && WEXITSTATUS(ended) == kExitBadInput) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", why));
  }
  return absl::InternalError(absl::StrCat(source_name, ": PCL failed on it (", DescribeExit(ended),
                                          "); is the file damaged?", why.empty() ? "" : " It said: ", why));
}

}  // namespace weft
