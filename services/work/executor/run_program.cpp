#include "services/work/executor/run_program.h"

#include <poll.h>
#include <sys/wait.h>

#include <algorithm>
#include <iterator>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/ground/process/exit_status.h"
#include "services/work/executor/child_process.h"

namespace weft {
namespace {

constexpr size_t kShownBytes = 500;

// The end of it, where programs say what went wrong.
std::string Printed(const std::string& out, const std::string& err) {
  const std::string all = out + err;
  const std::string end = all.substr(all.size() - std::min(all.size(), kShownBytes));
  const absl::string_view words = absl::StripAsciiWhitespace(end);
  return words.empty() ? "" : absl::StrCat("; it printed: ", words);
}

}  // namespace

absl::StatusOr<std::string> RunProgram(const std::string& program, const ProgramRun& run) {
  constexpr std::chrono::milliseconds kLook{100};
  ChildSettings settings;
  settings.input = run.input;
  settings.hides_secrets = run.hides_secrets;
  WEFT_ASSIGN_OR_RETURN(ChildProcess child, ChildProcess::Spawn(program, run.arguments, settings));
  const auto deadline = std::chrono::steady_clock::now() + run.patience;
  std::string out, err;
  for (bool ended = false; !ended;) {
    pollfd files[] = {{child.exit_fd(), POLLIN, 0}, {child.out_fd(), POLLIN, 0}, {child.err_fd(), POLLIN, 0}};
    poll(files, std::size(files), static_cast<int>(kLook.count()));
    ended = (files[0].revents & POLLIN) != 0;  // so that all it printed is read below
    out += child.ReadOut();
    err += child.ReadErr();
    out.resize(std::min(out.size(), run.most_bytes));
    if (err.size() > run.most_bytes) err.erase(0, err.size() - run.most_bytes);
    if (ended) break;
    if (run.stop.stop_requested()) return absl::CancelledError(absl::StrCat(program, ": was to stop"));
    if (std::chrono::steady_clock::now() > deadline) {
      return absl::DeadlineExceededError(absl::StrCat(program, ": took more than ",
                                                      std::chrono::duration<double>(run.patience).count(),
                                                      " s and was ended", Printed(out, err)));
    }
  }
  const int status = child.Reap();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return out;
  return absl::InternalError(absl::StrCat(program, ": ", DescribeExit(status), Printed(out, err)));
}

}  // namespace weft
