#include "services/tools/cli/net_trainer.h"

#include <poll.h>
#include <sys/wait.h>

#include <csignal>
#include <filesystem>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/program_beside.h"
#include "services/work/executor/child_process.h"

namespace weft {
namespace {

constexpr char kTrainer[] = "weft-train";
constexpr double kMinutesPerHour = 60;
constexpr size_t kShownBytes = 500;

std::string SubcommandOf(NetKind kind) {
  switch (kind) {
    case NetKind::kCorrection:
      return "net";
    case NetKind::kPixels:
      return "pixels";
    case NetKind::kPrior:
      return "prior";
  }
  return "";
}

std::vector<std::string> ArgumentsOf(const NetTask& task) {
  std::vector<std::string> out = {SubcommandOf(task.kind),
                                  task.samples,
                                  "--out",
                                  task.folder,
                                  "--steps",
                                  absl::StrCat(task.steps),
                                  "--seed",
                                  absl::StrCat(task.seed),
                                  "--threads",
                                  absl::StrCat(task.threads)};
  if (task.hours > 0) out.insert(out.end(), {"--minutes", absl::StrCat(kMinutesPerHour * task.hours)});
  return out;
}

}  // namespace

absl::Status CheckNetTrainer() {
  const std::string program = ProgramBeside(kTrainer);
  if (std::error_code error; std::filesystem::exists(program, error)) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(
      "--net needs weft-train, and ", program,
      " is missing; install the package weft-train, or Debian's libtorch-dev and libonnx-dev and build weft "
      "with -DWEFT_TRAIN=ON, or train without --net. Driving with a net needs none of them"));
}

absl::Status RunNetTrainer(const NetTask& task,
                           const std::function<void(const v1::NetTrainingProgress& now)>& on_progress,
                           const std::stop_token& stop) {
  constexpr int kLook_ms = 100;
  WEFT_ASSIGN_OR_RETURN(ChildProcess child, ChildProcess::Spawn(ProgramBeside(kTrainer), ArgumentsOf(task)));
  LineSplitter lines;
  std::string errors;
  bool is_told = false;
  for (bool has_ended = false; !has_ended;) {
    pollfd files[] = {{child.exit_fd(), POLLIN, 0}, {child.out_fd(), POLLIN, 0}, {child.err_fd(), POLLIN, 0}};
    poll(files, std::size(files), kLook_ms);
    has_ended = (files[0].revents & POLLIN) != 0;  // so that all it printed is read below
    for (const std::string& line : lines.Add(child.ReadOut())) {
      v1::NetTrainingProgress now;
      if (ParseJson(line, kTrainer, now).ok()) on_progress(now);
    }
    errors += child.ReadErr();
    if (errors.size() > kShownBytes) errors.erase(0, errors.size() - kShownBytes);
    if (stop.stop_requested() && !std::exchange(is_told, true)) child.Signal(SIGTERM);
  }
  const int status = child.Reap();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return absl::OkStatus();
  if (is_told)
    return absl::CancelledError("the training of the net was stopped; the same command goes on with it");
  return absl::InternalError(absl::StrCat(kTrainer, ": ", DescribeExit(status),
                                          "; it printed: ", absl::StripAsciiWhitespace(errors)));
}

}  // namespace weft
