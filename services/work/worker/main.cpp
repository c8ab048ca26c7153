// `weft-worker TASK.json`: one task, one process. `weft-worker --read`: one reading.
#include <CLI/CLI.hpp>

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <stop_token>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/ground/confinement/worker_user.h"
#include "services/ground/process/command_option.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/freed_memory.h"
#include "services/ground/process/no_threads.h"
#include "services/ground/process/process_limits.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/work/reading/run_reading.h"
#include "services/work/worker/run_task.h"
#include "services/work/worker/worker_event.h"
#include "services/work/worker/worker_usage.h"

namespace {

// On the machine of the daemon those who serve go first. With 10, whatever else a machine works on would
// starve workers; with 4 they have a third of what others have.
constexpr int kNiceness = 4;
constexpr int kLiveNiceness = 10;

// Where events go: standard output, or a file that other machines read.
class EventLog {
 public:
  // Opened before the process is confined. Errors of WriteError.
  absl::Status OpenFile(const std::string& path) {
    file_ = weft::UniqueFd(open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
    return file_.open() ? absl::OkStatus() : weft::WriteError(path, errno);
  }

  // False when nobody listens any more, or the file cannot be written.
  bool Add(const weft::v1::WorkerEvent& event) const {
    const int fd = file_.open() ? file_.get() : STDOUT_FILENO;
    if (weft::WriteAll(fd, weft::WorkerEventLine(event) + '\n') != 0) return false;
    // A network file system sends what was written only when it must.
    return !file_.open() || event.has_advanced() || fdatasync(fd) == 0;
  }

 private:
  weft::UniqueFd file_;
};

// On a network file system a file may be seen a while after it was written elsewhere.
void AwaitFile(const std::string& path, std::chrono::seconds patience) {
  constexpr std::chrono::milliseconds kLook{200};
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (access(path.c_str(), R_OK) != 0 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(kLook);
}

// The results of a killed worker are whole, so there is no reason to outlive the daemon.
bool DieWithParent(int parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  return parent == 0 || getppid() == parent;
}

absl::Status RunTaskFile(const std::string& path, const EventLog& log, const weft::UsageMeter& meter,
                         int niceness) {
  weft::v1::Task task;
  WEFT_RETURN_IF_ERROR(weft::ReadJsonFile(path, task));
  std::stop_source stop;
  const auto report = [&stop, &log, &meter](const weft::v1::WorkerEvent& event) {
    weft::v1::WorkerEvent told = event;
    // Those are told often, by any thread.
    if (!event.has_advanced()) *told.mutable_usage() = meter.Now();
    if (!log.Add(told)) stop.request_stop();
  };
  // Threads that run by now would stay free, and a file of others may take over any of them.
  WEFT_ASSIGN_OR_RETURN(const weft::UniqueFd out, weft::ConfineToTask(task, report));
  const weft::StopOnSignal signals;
  // Whoever records goes first.
  if (task.spec().live_every() > 0) [[maybe_unused]]
    const int ignored = nice(kLiveNiceness - niceness);
  const std::stop_callback forward(signals.token(), [&stop] { stop.request_stop(); });
  return weft::RunTask(task, out, report, stop.get_token());
}

// The same, with exceptions as errors.
absl::Status RunWithin(const std::string& path, const EventLog& log, const weft::UsageMeter& meter,
                       int64_t memory_mib, int niceness) {
  try {
    return RunTaskFile(path, log, meter, niceness);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "out of memory", memory_mib > 0 ? absl::StrCat("; a worker may take ", memory_mib,
                                                       " MiB, --worker-memory-mib of weftd changes that")
                                        : ""));
  } catch (const std::exception& error) {
    if (!weft::IsLackOfThreads(error)) return absl::InternalError(error.what());
    // No fault of the frame, and no reason to give up the job.
    return weft::ReportedToDaemon(weft::NoFurtherThreads(),
                                  [&log](const weft::v1::WorkerEvent& event) { log.Add(event); });
  }
}

// A Reading from standard input, its answer to standard output.
absl::Status ReadForDaemon() {
  weft::v1::Reading reading;
  if (!reading.ParseFromFileDescriptor(STDIN_FILENO))
    return absl::InvalidArgumentError("standard input: is no weft.v1.Reading");
  const std::string answer = weft::RunReading(reading).SerializeAsString();
  if (const int error = weft::WriteAll(STDOUT_FILENO, answer); error != 0)
    return weft::WriteError("standard output", error);
  return absl::OkStatus();
}

struct WorkerFlags {
  std::string path, user, events;
  int parent = 0, patience_s = 0;
  int64_t memory_mib = 0;
  bool reads = false;
};

void AddFlags(CLI::App& app, WorkerFlags& flags) {
  app.set_version_flag("--version", "weft-worker " WEFT_VERSION, "Print the version and exit");
  app.add_option("TASK", flags.path, "The task.json");
  app.add_flag("--read", flags.reads, "Read files of others instead: a weft.v1.Reading from standard input");
  weft::AddOption(app, "--parent PID", flags.parent, "End at once unless started by this process");
  weft::AddOption(app, "--memory-mib MIB", flags.memory_mib, "Memory that this process may take; 0: any");
  weft::AddOption(app, "--user NAME", flags.user, "Run as this user; needs root");
  weft::AddOption(app, "--events FILE", flags.events,
                  "Append the events to this file, for a daemon on another machine");
  weft::AddOption(app, "--patience-s S", flags.patience_s,
                  "Wait for TASK so long, on file systems that show files late");
}

}  // namespace

int main(int argc, char** argv) {
  weft::FailBeyondFileSize();
  weft::KeepFreedMemory();
  CLI::App app("Registers the frames of one task. Started by weftd; prints an event as JSON on each line.",
               "weft-worker");
  WorkerFlags flags;
  AddFlags(app, flags);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? weft::kExitDone : weft::kExitBadInput;
  }
  if (!flags.user.empty()) {
    if (const absl::Status changed = weft::BecomeWorkerUser(flags.user); !changed.ok()) {
      weft::PrintError(changed);
      return weft::kExitFailed;
    }
  }
  const int niceness = flags.parent != 0 ? kNiceness : 0;
  [[maybe_unused]] const int ignored = nice(niceness);
  // After the change of the user, which forgets it.
  if (!DieWithParent(flags.parent)) return weft::kExitFailed;
  if (const absl::Status limited = weft::LimitMemory(flags.memory_mib); !limited.ok()) {
    weft::PrintError(limited);
    return weft::kExitFailed;
  }
  signal(SIGPIPE, SIG_IGN);
  if (flags.reads) {
    const absl::Status read = ReadForDaemon();
    if (!read.ok()) weft::PrintError(read);
    return weft::ExitStatusOf(read);
  }
  if (flags.path.empty()) {
    weft::PrintError(absl::InvalidArgumentError("TASK: must be given; weft-worker is started by weftd"));
    return weft::kExitBadInput;
  }
  const weft::UsageMeter meter;
  EventLog log;
  if (!flags.events.empty()) {
    if (const absl::Status opened = log.OpenFile(flags.events); !opened.ok()) {
      weft::PrintError(opened);
      return weft::kExitFailed;
    }
    log.Add(weft::BeganEvent());
  }
  AwaitFile(flags.path, std::chrono::seconds(flags.patience_s));
  const absl::Status status = RunWithin(flags.path, log, meter, flags.memory_mib, niceness);
  if (!status.ok()) weft::PrintError(status);
  log.Add(weft::EndedEvent(weft::ExitStatusOf(status), meter.Now()));
  return weft::ExitStatusOf(status);
}
