#include "services/ground/process/ffmpeg_process.h"

#include <sys/socket.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

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
  UniqueFd end;
  if (const int error = MakeSocketPair(process.pipe_, end))
    return absl::InternalError(absl::StrCat("no socket for ffmpeg: ", std::strerror(error)));
  process.errors_ = MemoryFile("ffmpeg");
  if (!process.errors_.open())
    return absl::InternalError(absl::StrCat("no memory file for ffmpeg: ", std::strerror(errno)));
  std::vector<std::string> words = {"ffmpeg", "-hide_banner", "-loglevel", "error", "-nostdin", "-y"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const int failure = process.program_.Start(words, {end.get(), end.get(), process.errors_.get()});
  if (failure == 0) return process;
  return absl::NotFoundError(absl::StrCat("the program ffmpeg does not start: ", std::strerror(failure),
                                          "; install the package ffmpeg"));
}

std::string FfmpegProcess::LastWords() const {
  std::string words = ContentOf(errors_);
  words.erase(0, words.size() - std::min(words.size(), kMostWords));
  return std::string(absl::StripAsciiWhitespace(words));
}

absl::Status FfmpegProcess::Write(const void* bytes, size_t size) {
  const auto* at = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t sent = send(pipe_.get(), at, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return absl::InternalError(absl::StrCat("ffmpeg ended early: ", LastWords()));
    at += sent;
    size -= static_cast<size_t>(sent);
  }
  return absl::OkStatus();
}

absl::Status FfmpegProcess::Read(void* bytes, size_t size) {
  if (ReceiveAll(pipe_, bytes, size) == 0) return absl::OkStatus();
  return absl::OutOfRangeError(absl::StrCat("ffmpeg has no more: ", LastWords()));
}

absl::Status FfmpegProcess::Finish() {
  shutdown(pipe_.get(), SHUT_RDWR);  // also where it has more to say than was asked for
  const int state = program_.Wait();
  if (WIFEXITED(state) && WEXITSTATUS(state) == 0) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("ffmpeg failed: ", LastWords()));
}

}  // namespace weft
