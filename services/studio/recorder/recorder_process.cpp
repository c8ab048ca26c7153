#include "services/studio/recorder/recorder_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/take/take_files.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/spawned_program.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/studio/recording/session_file.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/recording/take_recovery.h"

namespace weft {
namespace {

bool HasEnded(const v1::RecorderState& state) {
  return state.phase() == v1::RECORDER_PHASE_ENDED || state.phase() == v1::RECORDER_PHASE_FAILED ||
         state.phase() == v1::RECORDER_PHASE_RECOVERED;
}

// A recorder that failed may have been unable to close its take, too.
bool LeftTakeOpen(const RecorderFiles& files, const v1::RecorderState& state) {
  if (!HasEnded(state)) return true;
  if (state.phase() != v1::RECORDER_PHASE_FAILED || !IsRecordedTake(files.take)) return false;
  const absl::StatusOr<v1::Take> take = ReadTakeFile(files.take);
  return !take.ok() || take->state() == v1::TAKE_STATE_RECORDING;
}

// Its number while it lives, 0 otherwise. A test of the lock takes it for a moment, which a recorder that
// starts waits for.
pid_t ProcessOf(const RecorderFiles& files) {
  const UniqueFd lock(open(files.lock.c_str(), O_RDONLY | O_CLOEXEC));
  if (!lock.open() || flock(lock.get(), LOCK_SH | LOCK_NB) == 0) return 0;
  const absl::StatusOr<std::string> text = ReadWholeFile(files.lock, 4096);
  int pid = 0;
  if (!text.ok() || !absl::SimpleAtoi(*text, &pid) || pid <= 1) return 0;
  return pid;
}

// The program forks and lets go of us; its first process ends when the second holds the lock.
absl::Status Spawn(const std::string& program, const std::string& folder, const RecorderFiles& files) {
  const UniqueFd log_file(open(files.log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
  SpawnedProgram started;
  const int error =
      log_file.open() ? started.Start({program, folder}, {-1, log_file.get(), log_file.get()}) : errno;
  if (error == ENOENT) {
    return absl::NotFoundError(absl::StrCat(program, ": no such program; it is installed beside weftd"));
  }
  if (error != 0)
    return absl::InternalError(absl::StrCat(program, ": cannot be started (", strerror(error), ")"));
  const int status = started.Wait();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return absl::OkStatus();
  const absl::StatusOr<std::string> log = ReadWholeFile(files.log, uint64_t{1} << 20);
  return absl::InternalError(
      absl::StrCat(program, ": ", DescribeExit(status), log.ok() ? absl::StrCat("; ", *log) : ""));
}

// Of a take that cannot be recovered at this time, for example on a full disk. It can be looked at
// nevertheless.
void SayLater(const std::string& why, v1::RecorderState& state) {
  state.set_phase(v1::RECORDER_PHASE_FAILED);
  state.set_message(absl::StrCat("the recorder ended abnormally; the take cannot be recovered yet: ", why,
                                 "; it is tried again whenever somebody looks"));
}

}  // namespace

absl::Status StartRecorder(const std::string& program, const std::string& folder,
                           const v1::RecorderRequest& request) {
  WEFT_RETURN_IF_ERROR(CheckSession(request.session(), "session"));
  if (request.seconds() < 0) {
    return absl::InvalidArgumentError("seconds: is negative; give 0 to record until it is stopped");
  }
  const RecorderFiles files(folder);
  WEFT_RETURN_IF_ERROR(WriteJsonFile(files.request, request));
  return Spawn(program, folder, files);
}

absl::StatusOr<RecorderView> InspectRecorder(const std::string& folder) {
  const RecorderFiles files(folder);
  RecorderView view;
  WEFT_RETURN_IF_ERROR(ReadJsonFile(files.request, view.request, kSmallJson));
  // In this order: one that ends in between has written its last state before it let go.
  view.lives = ProcessOf(files) != 0;
  const absl::Status status = ReadJsonFile(files.state, view.state, kSmallJson);
  if (!status.ok() && !absl::IsNotFound(status)) return status;
  return view;
}

absl::Status StopRecorder(const std::string& folder) {
  const pid_t pid = ProcessOf(RecorderFiles(folder));
  if (pid == 0 || kill(pid, SIGTERM) == 0 || errno == ESRCH) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat(folder, ": its recorder, process ", pid, ", cannot be stopped (", strerror(errno), ")"));
}

absl::StatusOr<RecorderView> RecoverIfDead(const std::string& folder) {
  const RecorderFiles files(folder);
  absl::StatusOr<RecorderView> view = InspectRecorder(folder);
  if (!view.ok() || view->lives || !LeftTakeOpen(files, view->state)) return view;
  v1::RecorderState& state = view->state;
  // One that failed has said why, and is shown even if its take cannot be recovered.
  const bool failed = state.phase() == v1::RECORDER_PHASE_FAILED;
  const v1::RecorderState before = state;
  const std::string said = failed ? absl::StrCat(state.message(), "; the take was left open, and ")
                                  : "the recorder ended abnormally; ";
  state.set_phase(v1::RECORDER_PHASE_RECOVERED);
  state.set_updated_unix_ns(HostTime_ns());
  if (IsRecordedTake(files.take)) {
    const absl::StatusOr<v1::TakeRecoveryReport> recovered = RecoverRecordedTake(files.take);
    // FailedPrecondition: it was closed, and the recorder died before it could say so.
    if (!recovered.ok() && !absl::IsFailedPrecondition(recovered.status())) {
      state = before;
      if (!failed) SayLater(std::string(recovered.status().message()), state);
      return view;
    }
    state.set_message(absl::StrCat(said, "what it had acknowledged was recovered"));
  } else {
    state.set_message("the recorder ended abnormally, before it recorded anything");
  }
  RemoveFile(files.room);
  // Where the disk is full the next look says the same.
  WriteJsonFile(files.state, state).IgnoreError();
  return view;
}

bool IsSettled(const std::string& folder) {
  const absl::StatusOr<RecorderView> view = InspectRecorder(folder);
  if (!view.ok()) return absl::IsNotFound(view.status());
  return view->lives || !LeftTakeOpen(RecorderFiles(folder), view->state);
}

}  // namespace weft
