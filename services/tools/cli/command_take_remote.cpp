// weft take start, stop, watch, list, pin, delete, restore, empty-trash: takes of a daemon.
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <stop_token>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "base/mutex.h"
#include "base/status_code.h"
#include "base/timed_id.h"
#include "services/formats/files/enum_words.h"
#include "services/ground/process/exit_status.h"
#include "services/studio/recording/session_file.h"
#include "services/studio/recording/take_words.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/remote_command.h"
#include "services/tools/client/take_client.h"

namespace weft {
namespace {

struct RemoteTakeOptions {
  std::string server;
  std::string take_id;
  std::string session;
  std::string lease;
  double seconds = 0;
  bool no_disk_test = false;
  int limit = 20;
  bool trash = false;
  std::string words;
  bool unpin = false;
  bool json = false;
};

using RemoteTakeContext = RemoteContext<TakeClient, RemoteTakeOptions>;

const char* PhaseWord(v1::RecorderPhase phase) { return EnumWord(phase, "starting"); }

std::string TakeLine(const v1::RecordedTake& take) {
  const v1::RecorderState& state = take.state();
  std::string line =
      absl::StrFormat("%-9s  %6.0f s  %s sets, %s dropped, %s frames missing", PhaseWord(state.phase()),
                      state.elapsed_s(), WithSeparators(state.sets_recorded()),
                      WithSeparators(state.sets_dropped()), WithSeparators(state.frames_missing()));
  if (state.phase() == v1::RECORDER_PHASE_RECORDING && state.disk_minutes_left() >= 0) {
    absl::StrAppendFormat(&line, ", disk for %.0f min", state.disk_minutes_left());
  }
  for (const std::string* said : {&take.keeping().slate(), &take.keeping().name(), &take.timecode()})
    if (!said->empty()) absl::StrAppend(&line, "  ", *said);
  if (take.keeping().pinned()) absl::StrAppend(&line, "  pinned");
  if (!state.message().empty()) absl::StrAppend(&line, "  (", state.message(), ")");
  if (!take.keeping().deleted_because().empty()) {
    absl::StrAppend(&line, "  (in the trash: ", take.keeping().deleted_because(), ")");
  }
  return line;
}

std::string EventLine(const v1::TakeEvent& event) {
  const absl::Time when = absl::FromUnixNanos(event.noticed_unix_ns());
  std::string line = absl::FormatTime("%H:%M:%S  ", when, absl::LocalTimeZone());
  if (event.event() != "note") {
    const std::string last =
        event.last_set() > event.first_set() ? absl::StrCat(" to ", event.last_set()) : "";
    absl::StrAppend(&line, "set ", event.first_set(), last, " ", event.event(), "  ");
  }
  if (!event.camera().empty()) absl::StrAppend(&line, "camera ", event.camera(), ": ");
  return line + event.cause();
}

// How the registration of a take keeps up with it.
std::string LiveWords(const v1::RecordedTake& take) {
  if (take.live_job_id().empty()) return "";
  // Frames that an avatar drives observe none.
  const double coverage = take.live().coverage();
  return absl::StrCat(coverage > 0 ? absl::StrFormat(", %.1f %% of the cells observed", 100 * coverage) : "",
                      absl::StrFormat(", meshes %.1f s behind", take.live().latency_s()));
}

// A take that could not be recorded to its end fails the command.
absl::Status OutcomeOfTake(const v1::RecordedTake& take) {
  const v1::RecorderState& state = take.state();
  if (state.phase() == v1::RECORDER_PHASE_ENDED) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("take ", take.id(), ": ", state.message()));
}

// Until the cameras are recorded, or why they are not. A recorder that takes longer is left to itself.
absl::Status WaitForStart(const RemoteTakeContext& context, v1::RecordedTake& take) {
  constexpr std::chrono::seconds kBeginTimeout{30};
  std::stop_source enough;
  const std::stop_callback on_interrupt(context.stop, [&enough] { enough.request_stop(); });
  const std::jthread timer([&enough, kBeginTimeout](const std::stop_token& stop) {
    Mutex mutex;
    MutexLock lock(mutex);
    std::condition_variable_any never;
    never.wait_for(lock, stop, kBeginTimeout, [] { return false; });
    enough.request_stop();
  });
  const absl::StatusOr<v1::RecordedTake> ended = context.client.Watch(
      take.id(),
      [&](const v1::RecordedTake& now) {
        take = now;
        if (now.state().phase() == v1::RECORDER_PHASE_RECORDING) enough.request_stop();
      },
      enough.get_token());
  if (!ended.ok()) return absl::OkStatus();  // it goes on, whoever watches it
  const v1::RecorderState& state = ended->state();
  const bool is_short = state.phase() == v1::RECORDER_PHASE_ENDED && state.message().empty();
  if (is_short || state.sets_recorded() > 0) return absl::OkStatus();
  return absl::Status(StatusCodeOf(state.error_code()),
                      absl::StrCat("take ", take.id(), ": ",
                                   state.message().empty() ? "its recorder ended" : state.message()));
}

absl::Status StartRemoteTake(const RemoteTakeContext& context) {
  const RemoteTakeOptions& options = context.options;
  if (options.session.empty() == options.lease.empty()) {
    return absl::InvalidArgumentError(
        "give either --session FILE, or the --lease that `weft session open` printed (or WEFT_LEASE)");
  }
  v1::StartTakeRequest request;
  request.set_lease(options.lease);
  if (!options.session.empty()) {
    WEFT_ASSIGN_OR_RETURN(*request.mutable_recording()->mutable_session(), ReadSession(options.session));
  }
  request.mutable_recording()->set_seconds(context.options.seconds);
  request.mutable_recording()->set_no_disk_test(context.options.no_disk_test);
  request.set_idempotency_key(NewTimedId());
  WEFT_ASSIGN_OR_RETURN(v1::RecordedTake take, context.client.Start(request));
  if (!context.options.json) std::printf("%s\n", take.id().c_str());
  std::fflush(stdout);
  const absl::Status started = WaitForStart(context, take);
  if (!context.options.json) return started;
  const absl::Status printed = PrintJsonMessage(take);
  return started.ok() ? printed : started;
}

absl::Status WatchRemoteTake(const RemoteTakeContext& context) {
  const bool shows = !context.quiet && !context.options.json && isatty(STDERR_FILENO);
  const bool tells = !context.quiet && !context.options.json;
  const auto show = [shows, tells](const v1::RecordedTake& take) {
    for (const v1::TakeEvent& event : take.events()) {
      if (tells && event.event() != "end")
        std::fprintf(stderr, "%s%s\n", shows ? "\r\033[K" : "", EventLine(event).c_str());
    }
    if (shows) std::fprintf(stderr, "\r%s%s\033[K", TakeLine(take).c_str(), LiveWords(take).c_str());
  };
  const absl::StatusOr<v1::RecordedTake> take =
      context.client.Watch(context.options.take_id, show, context.stop);
  if (shows) std::fputc('\n', stderr);
  if (!take.ok()) return take.status();
  if (context.options.json) {
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(*take));
  } else if (!context.quiet) {
    for (const std::string& warning : take->state().warnings()) PrintWarning(warning);
    std::printf("%s\ntake     %s\n", TakeLine(*take).c_str(), take->folder().c_str());
  }
  return OutcomeOfTake(*take);
}

absl::Status StopRemoteTake(const RemoteTakeContext& context) {
  WEFT_RETURN_IF_ERROR(context.client.Stop(context.options.take_id).status());
  return WatchRemoteTake(context);  // until it is closed
}

absl::Status ListRemoteTakes(const RemoteTakeContext& context) {
  WEFT_ASSIGN_OR_RETURN(
      const v1::ListTakesResponse list,
      context.client.List(context.options.limit, context.options.trash, context.options.words));
  if (context.options.json) return PrintJsonMessage(list);
  for (const std::string& warning : list.warnings()) PrintWarning(warning);
  if (list.takes().empty()) {
    std::printf("no takes %s%sat %s\n", context.options.trash ? "in the trash " : "",
                context.options.words.empty() ? "" : "with these words ", context.options.server.c_str());
  }
  for (const v1::RecordedTake& take : list.takes())
    std::printf("%s  %s\n", take.id().c_str(), TakeLine(take).c_str());
  return absl::OkStatus();
}

absl::Status PrintTakeState(const absl::StatusOr<v1::RecordedTake>& take, const RemoteTakeContext& context) {
  return PrintAnswer(take, context, [](const v1::RecordedTake& one) {
    std::printf("%s  %s\n", one.id().c_str(), TakeLine(one).c_str());
  });
}

absl::Status PinRemoteTake(const RemoteTakeContext& context) {
  return PrintTakeState(context.client.Pin(context.options.take_id, !context.options.unpin), context);
}

absl::Status DeleteRemoteTake(const RemoteTakeContext& context) {
  return PrintTakeState(context.client.Delete(context.options.take_id), context);
}

absl::Status RestoreRemoteTake(const RemoteTakeContext& context) {
  return PrintTakeState(context.client.Restore(context.options.take_id), context);
}

absl::Status EmptyRemoteTrash(const RemoteTakeContext& context) {
  return PrintAnswer(context.client.EmptyTrash(context.options.take_id), context, [](const auto& emptied) {
    std::printf("%d takes removed, %.2f GB\n", emptied.takes(), static_cast<double>(emptied.bytes()) / 1e9);
  });
}

void AddStartArguments(CLI::App& command, RemoteTakeOptions& options) {
  AddOption(command, "--session FILE", options.session, "session.json with cameras, rate and tolerance");
  AddOption(command, "--lease LEASE", options.lease,
            "Record the cameras of the session that `weft session open` opened")
      ->envname("WEFT_LEASE");
  AddOption(command, "--seconds S", options.seconds, "How long; 0: until `weft take stop`",
            CLI::NonNegativeNumber);
  command.add_flag("--no-disk-test", options.no_disk_test,
                   "Do not measure first whether the disk keeps up with the cameras");
}

void AddTakeListArguments(CLI::App& command, RemoteTakeOptions& options) {
  AddListLimit(command, options);
  command.add_flag("--trash", options.trash, "Those in the trash instead");
  AddOption(command, "--search WORDS", options.words,
            "Those alone in whose slate, name, notes, id or timecode all of these words stand");
}

void AddMaybeTake(CLI::App& command, RemoteTakeOptions& options) {
  command.add_option("TAKE", options.take_id, "Id of the take, as `weft take list` prints it");
}

void AddTake(CLI::App& command, RemoteTakeOptions& options) {
  AddMaybeTake(command, options);
  command.get_option("TAKE")->required();
}

void AddPinArguments(CLI::App& command, RemoteTakeOptions& options) {
  AddTake(command, options);
  command.add_flag("--off", options.unpin, "Unpin it");
}

}  // namespace

void AddRemoteTakeCommands(CLI::App& take, CommandLine& line) {
  const RemoteCommand<TakeClient, RemoteTakeOptions> commands[] = {
      {"start",
       "Have a daemon record the cameras of a session, and print the id of the take. The take goes on when "
       "this command or the daemon ends",
       "  weft take start --session session.json --server 127.0.0.1:7411\n"
       "  weft take start --lease $LEASE --server 127.0.0.1:7411\n"
       "  weft take start --session session.json --seconds 60 --server 127.0.0.1:7411",
       AddStartArguments, StartRemoteTake},
      {"stop", "Close a take that a daemon records, and wait until it is closed",
       "  weft take stop 20260131-104500-1a2b3c4d --server 127.0.0.1:7411", AddTake, StopRemoteTake},
      {"watch",
       "Follow a take that a daemon records until it has ended. Stopping the command leaves the take alone. "
       "Exit status 1 when it failed",
       "  weft take watch 20260131-104500-1a2b3c4d --server 127.0.0.1:7411", AddTake, WatchRemoteTake},
      {"list", "List the takes that a daemon records or recorded, the newest first",
       "  weft take list --server 127.0.0.1:7411\n"
       "  weft take list --search \"12A walk\" --server 127.0.0.1:7411\n"
       "  weft take list --trash --server 127.0.0.1:7411",
       AddTakeListArguments, ListRemoteTakes},
      {"pin", "Keep a take of a daemon from being deleted or cleared away",
       "  weft take pin 20260131-104500-1a2b3c4d --server 127.0.0.1:7411\n"
       "  weft take pin --off 20260131-104500-1a2b3c4d --server 127.0.0.1:7411",
       AddPinArguments, PinRemoteTake},
      {"delete",
       "Move a take of a daemon to its trash. `weft take restore` brings it back until the trash is emptied",
       "  weft take delete 20260131-104500-1a2b3c4d --server 127.0.0.1:7411", AddTake, DeleteRemoteTake},
      {"restore", "Bring a take back from a daemon's trash",
       "  weft take restore 20260131-104500-1a2b3c4d --server 127.0.0.1:7411", AddTake, RestoreRemoteTake},
      {"empty-trash", "Remove the takes in a daemon's trash, or one of them, for good",
       "  weft take empty-trash --server 127.0.0.1:7411\n"
       "  weft take empty-trash 20260131-104500-1a2b3c4d --server 127.0.0.1:7411",
       AddMaybeTake, EmptyRemoteTrash}};
  for (const auto& command : commands) AddRemoteCommand(take, line, command);
}

}  // namespace weft
