#include "services/tools/cli/confined_run.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/confinement/confinement.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/process_limits.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

int64_t MachineMemory_mib() {
  return static_cast<int64_t>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGESIZE) / (int64_t{1} << 20);
}

// The user's own links are followed: those of the command line, and those within what it names.
absl::StatusOr<Confinement> ConfinementOf(const ConfinedFiles& files) {
  Confinement confinement;
  std::error_code error;
  for (const std::string& path : files.readable) {
    if (path.empty()) continue;
    const fs::path real = fs::weakly_canonical(fs::absolute(path), error);
    if (!error) confinement.readable.push_back(real.string());
  }
  for (const std::string& path : files.writable) {
    if (path.empty()) continue;
    const fs::path real = fs::weakly_canonical(fs::absolute(path), error);
    if (error) return WriteError(path, error.value());
    confinement.writable.push_back(real.string());
  }
  confinement.links.allowed = {"/"};
  confinement.may_run_programs = files.may_run_programs;
  return confinement;
}

// Makes the writable folders, and removes those that are empty in the end.
class MadeFolders {
 public:
  absl::Status Make(const std::vector<std::string>& folders) {
    for (const std::string& folder : folders) {
      const bool is_new = !fs::exists(folder);
      WEFT_RETURN_IF_ERROR(CreateFolders(folder));
      if (is_new) made_.push_back(folder);
    }
    return absl::OkStatus();
  }
  ~MadeFolders() {
    for (const std::string& folder : made_) RemoveFile(folder);
  }

 private:
  std::vector<std::string> made_;
};

absl::Status Confine(pid_t parent, const Confinement& confinement) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) return absl::CancelledError("the command has ended");
  absl::Status status = LimitMemory(MachineMemory_mib());
  if (status.ok()) status = ConfineProcess(confinement);
  return status;
}

// Waits, and hands on signals that somebody sends to this process alone: those of a terminal reach both.
int Await(pid_t child, const sigset_t& signals) {
  for (;;) {
    siginfo_t info = {};
    const int signal = sigwaitinfo(&signals, &info);
    if (signal > 0 && signal != SIGCHLD && info.si_code <= 0) kill(child, signal);
    int status = 0;
    if (waitpid(child, &status, WNOHANG) != child) continue;
    if (WIFEXITED(status)) return WEXITSTATUS(status);
    const int by = WTERMSIG(status);
    if (by != SIGINT && by != SIGTERM && by != SIGHUP) {
      PrintError(absl::InternalError(
          absl::StrCat("the process that read the inputs was ended: ", DescribeExit(status),
                       "; are they from somebody whom you trust?")));
      return kExitFailed;
    }
    // As if this process had been ended.
    ::signal(by, SIG_DFL);
    sigset_t one;
    sigemptyset(&one);
    sigaddset(&one, by);
    sigprocmask(SIG_UNBLOCK, &one, nullptr);
    raise(by);
  }
}

}  // namespace

int RunConfinedProcess(const ConfinedFiles& files, const std::function<int()>& run) {
  MadeFolders folders;
  const absl::StatusOr<Confinement> confinement = ConfinementOf(files);
  absl::Status status = confinement.status();
  if (status.ok()) status = folders.Make(confinement->writable);
  if (!status.ok()) {
    PrintError(status);
    return ExitStatusOf(status);
  }
  sigset_t signals, before;
  sigemptyset(&signals);
  for (const int signal : {SIGCHLD, SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  sigprocmask(SIG_BLOCK, &signals, &before);
  std::fflush(nullptr);
  const pid_t parent = getpid(), child = fork();
  if (child < 0) {
    PrintError(
        absl::ResourceExhaustedError(absl::StrCat("no process can be started: ", std::strerror(errno))));
    return kExitFailed;
  }
  if (child > 0) {
    const int exit_status = Await(child, signals);
    sigprocmask(SIG_SETMASK, &before, nullptr);
    return exit_status;
  }
  sigprocmask(SIG_SETMASK, &before, nullptr);
  if (const absl::Status confined = Confine(parent, *confinement); !confined.ok()) {
    PrintError(confined);
    _exit(kExitFailed);
  }
  const int exit_status = run();
  std::fflush(nullptr);
  _exit(exit_status);
}

}  // namespace weft
