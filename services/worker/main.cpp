// `weft-worker TASK.json`: one task, one process.
#include <CLI/CLI.hpp>

#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <stop_token>
#include <string>

#include "absl/strings/str_cat.h"
#include "services/confinement/worker_user.h"
#include "services/files/atomic_file.h"
#include "services/files/json_file.h"
#include "services/process/exit_status.h"
#include "services/process/file_size.h"
#include "services/process/memory_limit.h"
#include "services/process/stop_on_signal.h"
#include "services/worker/run_task.h"
#include "services/worker/worker_event.h"

namespace {

// False when nobody listens any more.
bool PrintLine(std::string line) {
  line += '\n';
  return weft::WriteAll(STDOUT_FILENO, line) == 0;
}

// The results of a killed worker are whole, so there is no reason to outlive the daemon.
bool DieWithParent(int parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  return parent == 0 || getppid() == parent;
}

absl::Status RunTaskFile(const std::string& path) {
  weft::v1::Task task;
  if (absl::Status status = weft::ReadJsonFile(path, task); !status.ok()) return status;
  std::stop_source stop;
  const auto report = [&stop](const weft::v1::WorkerEvent& event) {
    if (!PrintLine(weft::WorkerEventLine(event))) stop.request_stop();
  };
  // Threads that run by now would stay free, and a file of others may take over any of them.
  const absl::StatusOr<weft::UniqueFd> out = weft::ConfineToTask(task, report);
  if (!out.ok()) return out.status();
  const weft::StopOnSignal signals;
  // Whoever records goes first.
  constexpr int kNiceness = 10;
  if (task.spec().live_every() > 0) [[maybe_unused]]
    const int ignored = nice(kNiceness);
  const std::stop_callback forward(signals.token(), [&stop] { stop.request_stop(); });
  return weft::RunTask(task, *out, report, stop.get_token());
}

}  // namespace

int main(int argc, char** argv) {
  weft::FailBeyondFileSize();
  CLI::App app("Registers the frames of one task. Started by weftd; prints an event as JSON on each line.",
               "weft-worker");
  std::string path, user;
  int parent = 0;
  int64_t memory_mib = 0;
  app.set_version_flag("--version", "weft-worker " WEFT_VERSION, "Print the version and exit");
  app.add_option("TASK", path, "The task.json")->required();
  app.add_option("--parent", parent, "End at once unless started by this process")->type_name("PID");
  app.add_option("--memory-mib", memory_mib, "Memory that this process may take; 0: any")->type_name("MIB");
  app.add_option("--user", user, "Run as this user; needs root")->type_name("NAME");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? weft::kExitDone : weft::kExitBadInput;
  }
  if (!user.empty()) {
    if (const absl::Status changed = weft::BecomeWorkerUser(user); !changed.ok()) {
      weft::PrintError(changed);
      return weft::kExitFailed;
    }
  }
  // After the change of the user, which forgets it.
  if (!DieWithParent(parent)) return weft::kExitFailed;
  if (const absl::Status limited = weft::LimitMemory(memory_mib); !limited.ok()) {
    weft::PrintError(limited);
    return weft::kExitFailed;
  }
  signal(SIGPIPE, SIG_IGN);
  try {
    const absl::Status status = RunTaskFile(path);
    if (!status.ok()) weft::PrintError(status);
    return weft::ExitStatusOf(status);
  } catch (const std::bad_alloc&) {
    weft::PrintError(absl::ResourceExhaustedError(absl::StrCat(
        "out of memory", memory_mib > 0 ? absl::StrCat("; a worker may take ", memory_mib,
                                                       " MiB, --worker-memory-mib of weftd changes that")
                                        : "")));
  } catch (const std::exception& error) {
    weft::PrintError(absl::InternalError(error.what()));
  }
  return weft::kExitFailed;
}
