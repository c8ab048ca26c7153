// `weft-recorder FOLDER`: one take, one process that nobody else's end ends.
#include <CLI/CLI.hpp>

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include <atomic>
#include <exception>
#include <string>

#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/confinement/confinement.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/process_limits.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/studio/recorder/run_recorder.h"

namespace {

std::atomic<bool> told_to_stop = false;

// The open file, which holds the lock until the process ends; its copy in a forked process does, too.
absl::StatusOr<int> TakeLock(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) return weft::WriteError(path, errno);
  // Who looks whether a recorder lives takes it for a moment.
  constexpr int kTries = 100;
  constexpr useconds_t kPause_us = 10'000;
  for (int i = 0; i < kTries; ++i) {
    if (flock(fd, LOCK_EX | LOCK_NB) == 0) return fd;
    usleep(kPause_us);
  }
  return absl::FailedPreconditionError(absl::StrCat(path, ": another recorder records there"));
}

int Run(const std::string& folder, bool foreground) {
  const absl::StatusOr<int> lock = TakeLock(weft::RecorderFiles(folder).lock);
  if (!lock.ok()) {
    weft::PrintError(lock.status());
    return weft::ExitStatusOf(lock.status());
  }
  if (!foreground) {
    int ready[2];
    if (pipe(ready) != 0) return weft::kExitFailed;
    const pid_t child = fork();
    if (child < 0) return weft::kExitFailed;
    if (child > 0) {
      // Until the other process has written its number, or is gone.
      close(ready[1]);
      char byte = 0;
      _exit(read(ready[0], &byte, 1) == 1 ? weft::kExitDone : weft::kExitFailed);
    }
    close(ready[0]);
    setsid();
    const std::string pid = absl::StrCat(getpid(), "\n");
    if (ftruncate(*lock, 0) != 0 || weft::WriteAll(*lock, pid) != 0 || write(ready[1], "", 1) != 1)
      return weft::kExitFailed;
    close(ready[1]);
  } else if (const std::string pid = absl::StrCat(getpid(), "\n");
             ftruncate(*lock, 0) != 0 || weft::WriteAll(*lock, pid) != 0) {
    return weft::kExitFailed;
  }
  absl::Status status = weft::ConfineWriting({folder});
  if (status.ok()) status = weft::RunRecorder(folder, told_to_stop);
  if (!status.ok()) weft::PrintError(status);
  return weft::ExitStatusOf(status);
}

}  // namespace

int main(int argc, char** argv) {
  weft::FailBeyondFileSize();
  CLI::App app(
      "Records the take of FOLDER/request.json into FOLDER/take, in a session of its own. Started by weftd; "
      "SIGTERM "
      "closes the take.",
      "weft-recorder");
  std::string folder;
  bool foreground = false;
  app.set_version_flag("--version", "weft-recorder " WEFT_VERSION, "Print the version and exit");
  app.add_option("FOLDER", folder, "Holds request.json")->required();
  app.add_flag("--foreground", foreground, "Stay in the session of who starts it");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? weft::kExitDone : weft::kExitBadInput;
  }
  close_range(STDERR_FILENO + 1, ~0U, 0);
  // Whoever started us may wait for signals in a thread of its own, and block them for that.
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGHUP, SIG_IGN);
  for (const int number : {SIGTERM, SIGINT}) signal(number, [](int) { told_to_stop = true; });
  try {
    return Run(folder, foreground);
  } catch (const std::exception& error) {
    weft::PrintError(absl::InternalError(error.what()));
    return weft::kExitFailed;
  }
}
