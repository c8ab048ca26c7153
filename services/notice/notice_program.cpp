#include "services/notice/notice_program.h"

#include <poll.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "services/executor/child_process.h"
#include "services/process/exit_status.h"

namespace weft {
namespace {

constexpr size_t kShownBytes = 500;
constexpr std::chrono::milliseconds kLook{100};

void KeepEnd(std::string& text, const std::string& more) {
  text += more;
  if (text.size() > kShownBytes) text.erase(0, text.size() - kShownBytes);
}

}  // namespace

absl::Status RunNoticeProgram(const std::string& program, const std::string& path,
                              std::chrono::milliseconds patience, const std::stop_token& stop) {
  ChildSettings settings;
  settings.input = path;
  absl::StatusOr<ChildProcess> child = ChildProcess::Spawn(program, {}, settings);
  if (!child.ok()) return child.status();
  const auto deadline = std::chrono::steady_clock::now() + patience;
  std::string printed;
  for (bool ended = false; !ended;) {
    pollfd files[] = {
        {child->exit_fd(), POLLIN, 0}, {child->out_fd(), POLLIN, 0}, {child->err_fd(), POLLIN, 0}};
    poll(files, std::size(files), static_cast<int>(kLook.count()));
    KeepEnd(printed, child->ReadOut());
    KeepEnd(printed, child->ReadErr());
    ended = (files[0].revents & POLLIN) != 0;
    if (ended) break;
    if (stop.stop_requested()) return absl::CancelledError("the daemon stops");
    if (std::chrono::steady_clock::now() > deadline) {
      return absl::DeadlineExceededError(absl::StrCat(program, ": took more than ",
                                                      std::chrono::duration<double>(patience).count(),
                                                      " s and was ended; --on-end-timeout-s gives it more"));
    }
  }
  const int status = child->Reap();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(program, ": ", DescribeExit(status),
                                          "; it printed: ", absl::StripAsciiWhitespace(printed)));
}

}  // namespace weft
