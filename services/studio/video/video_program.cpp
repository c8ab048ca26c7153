#include "services/studio/video/video_program.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "services/ground/process/program_beside.h"

namespace weft {
namespace {

constexpr int kPixelsTimeout_ms = 60'000;  // for pixels
constexpr std::chrono::seconds kSilence{120};
constexpr rlim_t kMostSaid = rlim_t{512} << 20;  // as weft-video allows
constexpr useconds_t kLook_us = 50'000;

absl::Status SystemError(const char* what, int error) {
  return absl::ResourceExhaustedError(absl::StrCat("weft-video: ", what, ": ", std::strerror(error)));
}

// What is said goes to files in memory, to which the limit on the size of files applies: beyond it words are
// lost without one of that.
bool IsBeyondFileSize(size_t size) {
  rlimit limit = {};
  return getrlimit(RLIMIT_FSIZE, &limit) == 0 && size >= std::min<rlim_t>(limit.rlim_cur, kMostSaid);
}

}  // namespace

absl::StatusOr<VideoProgram> VideoProgram::Start(const std::string& program, const std::string& file,
                                                 const std::vector<std::string>& arguments, Out out) {
  const std::string confiner = ProgramBeside("weft-video");
  if (access(confiner.c_str(), X_OK) != 0)
    return absl::FailedPreconditionError(
        "weft-video, which reads videos, is not installed beside this program; install Weft again");
  VideoProgram started;
  started.kept_ = MemoryFile("weft-video");
  started.errors_ = MemoryFile("weft-video");
  if (!started.kept_.open() || !started.errors_.open()) return SystemError("no memory file", errno);
  UniqueFd end;
  if (const int error = out == Out::kPipe ? MakeSocketPair(started.pipe_, end) : 0)
    return SystemError("no socket", error);
  std::vector<std::string> words = {confiner, "--parent", absl::StrCat(getpid()), file, program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const int standard_out = out == Out::kPipe ? end.get() : started.kept_.get();
  // A group of its own: we end it.
  const int error =
      started.program_.Start(words, {-1, standard_out, started.errors_.get(), started.kept_.get()}, true);
  if (error == 0) return started;
  return SystemError("cannot start", error);
}

absl::Status VideoProgram::Read(void* bytes, size_t size) {
  switch (ReceiveAll(pipe_, bytes, size, kPixelsTimeout_ms)) {
    case 0:
      return absl::OkStatus();
    case ETIMEDOUT:
      return absl::DeadlineExceededError("ffmpeg made no progress for a minute");
    default:
      return absl::OutOfRangeError("no more frames");
  }
}

absl::StatusOr<VideoProgramOutput> VideoProgram::Finish(const std::function<bool(size_t bytes)>& grown) {
  VideoProgramOutput said;
  size_t known = 0;
  auto last = std::chrono::steady_clock::now();
  pipe_.Close();
  for (;;) {
    const int ended = program_.Poll(&said.wait_status);
    if (ended > 0) break;
    if (ended < 0) return SystemError("its end is unknown", errno);
    const size_t size = SizeOf(kept_) + SizeOf(errors_);
    if (size != known) last = std::chrono::steady_clock::now();
    known = size;
    if (grown && !grown(SizeOf(kept_))) {
      program_.Kill();
      return absl::CancelledError("stopped");
    }
    if (std::chrono::steady_clock::now() - last > kSilence) {
      program_.Kill();
      return absl::DeadlineExceededError("ffmpeg made no progress for two minutes");
    }
    usleep(kLook_us);
  }
  if (IsBeyondFileSize(SizeOf(kept_)) || IsBeyondFileSize(SizeOf(errors_)))
    return absl::ResourceExhaustedError(
        "ffmpeg says more of it than files may hold; raise the limit on the size of files (ulimit -f), or "
        "cut "
        "the film into parts");
  said.out = ContentOf(kept_);
  said.errors = ContentOf(errors_);
  return said;
}

absl::StatusOr<VideoProgramOutput> RunVideoProgram(const std::string& program, const std::string& file,
                                                   const std::vector<std::string>& arguments,
                                                   const std::function<bool(size_t bytes)>& grown) {
  WEFT_ASSIGN_OR_RETURN(VideoProgram started,
                        VideoProgram::Start(program, file, arguments, VideoProgram::Out::kKept));
  absl::StatusOr<VideoProgramOutput> said = started.Finish(grown);
  if (said.ok()) return said;
  return Naming(file, said.status());
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
