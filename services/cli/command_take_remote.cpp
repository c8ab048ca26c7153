// weft take start, stop, watch, list: takes that a daemon records.
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <random>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "services/cli/commands.h"
#include "services/cli/json_output.h"
#include "services/client/take_client.h"
#include "services/process/exit_status.h"
#include "services/process/stop_on_signal.h"
#include "services/recording/session_file.h"
#include "services/recording/take_words.h"

namespace weft {
namespace {

struct RemoteTakeOptions {
  std::string server;
  std::string take_id;
  std::string session;
  double seconds = 0;
  bool no_disk_test = false;
  int limit = 20;
  bool json = false;
};

struct RemoteTakeContext {
  TakeClient& client;
  const RemoteTakeOptions& options;
  bool quiet;
  std::stop_token stop;
};

const char* PhaseWord(v1::RecorderPhase phase) {
  switch (phase) {
    case v1::RECORDER_PHASE_RECORDING:
      return "recording";
    case v1::RECORDER_PHASE_ENDED:
      return "ended";
    case v1::RECORDER_PHASE_FAILED:
      return "failed";
    case v1::RECORDER_PHASE_RECOVERED:
      return "recovered";
    default:
      return "starting";
  }
}

std::string TakeLine(const v1::RecordedTake& take) {
  const v1::RecorderState& state = take.state();
  std::string line =
      absl::StrFormat("%-9s  %6.0f s  %s sets, %s dropped, %s frames missing", PhaseWord(state.phase()),
                      state.elapsed_s(), WithSeparators(state.sets_recorded()),
                      WithSeparators(state.sets_dropped()), WithSeparators(state.frames_missing()));
  if (state.phase() == v1::RECORDER_PHASE_RECORDING && state.disk_minutes_left() >= 0) {
    absl::StrAppendFormat(&line, ", disk for %.0f min", state.disk_minutes_left());
  }
  if (!state.message().empty()) absl::StrAppend(&line, "  (", state.message(), ")");
  return line;
}

// A take that could not be recorded to its end fails the command.
absl::Status OutcomeOfTake(const v1::RecordedTake& take) {
  const v1::RecorderState& state = take.state();
  if (state.phase() == v1::RECORDER_PHASE_ENDED) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("take ", take.id(), ": ", state.message()));
}

absl::Status StartRemoteTake(const RemoteTakeContext& context) {
  const absl::StatusOr<v1::Session> session = ReadSession(context.options.session);
  if (!session.ok()) return session.status();
  v1::StartTakeRequest request;
  *request.mutable_recording()->mutable_session() = *session;
  request.mutable_recording()->set_seconds(context.options.seconds);
  request.mutable_recording()->set_no_disk_test(context.options.no_disk_test);
  request.set_idempotency_key(
      absl::StrCat(UtcFileName(), "-", absl::Hex(std::random_device()(), absl::kZeroPad8)));
  const absl::StatusOr<v1::RecordedTake> take = context.client.Start(request);
  if (!take.ok()) return take.status();
  if (context.options.json) return PrintJsonMessage(*take);
  std::printf("%s\n", take->id().c_str());
  return absl::OkStatus();
}

absl::Status WatchRemoteTake(const RemoteTakeContext& context) {
  const bool shows = !context.quiet && !context.options.json && isatty(STDERR_FILENO);
  const auto show = [shows](const v1::RecordedTake& take) {
    if (shows) std::fprintf(stderr, "\r%s\033[K", TakeLine(take).c_str());
  };
  const absl::StatusOr<v1::RecordedTake> take =
      context.client.Watch(context.options.take_id, show, context.stop);
  if (shows) std::fputc('\n', stderr);
  if (!take.ok()) return take.status();
  if (context.options.json) {
    if (absl::Status status = PrintJsonMessage(*take); !status.ok()) return status;
  } else if (!context.quiet) {
    for (const std::string& warning : take->state().warnings()) PrintWarning(warning);
    std::printf("%s\ntake     %s\n", TakeLine(*take).c_str(), take->folder().c_str());
  }
  return OutcomeOfTake(*take);
}

absl::Status StopRemoteTake(const RemoteTakeContext& context) {
  const absl::StatusOr<v1::RecordedTake> take = context.client.Stop(context.options.take_id);
  if (!take.ok()) return take.status();
  return WatchRemoteTake(context);  // until it is closed
}

absl::Status ListRemoteTakes(const RemoteTakeContext& context) {
  const absl::StatusOr<v1::ListTakesResponse> list = context.client.List(context.options.limit);
  if (!list.ok()) return list.status();
  if (context.options.json) return PrintJsonMessage(*list);
  for (const std::string& warning : list->warnings()) PrintWarning(warning);
  if (list->takes().empty()) std::printf("no takes at %s\n", context.options.server.c_str());
  for (const v1::RecordedTake& take : list->takes())
    std::printf("%s  %s\n", take.id().c_str(), TakeLine(take).c_str());
  return absl::OkStatus();
}

// What a subcommand takes besides --server and --json.
enum class RemoteTakeArguments { kTake, kSession, kLimit };

struct RemoteTakeCommand {
  const char* name;
  const char* description;
  const char* example;
  RemoteTakeArguments arguments;
  absl::Status (*action)(const RemoteTakeContext& context);
};

void AddRemoteTakeCommand(CLI::App& take, CommandLine& line, const RemoteTakeCommand& what) {
  CLI::App* command = AddCommand(take, what.name, what.description, what.example);
  auto options = std::make_shared<RemoteTakeOptions>();
  command->add_option("--server", options->server, "HOST:PORT of the daemon")
      ->type_name("ADDRESS")
      ->envname("WEFT_SERVER")
      ->required();
  if (what.arguments == RemoteTakeArguments::kTake) {
    command->add_option("TAKE", options->take_id, "Id of the take, as `weft take list` prints it")
        ->required();
  } else if (what.arguments == RemoteTakeArguments::kLimit) {
    command->add_option("--limit", options->limit, "At most this many")
        ->type_name("N")
        ->check(CLI::Range(1, 1000));
  } else {
    command->add_option("--session", options->session, "session.json with cameras, rate and tolerance")
        ->required()
        ->type_name("FILE");
    command->add_option("--seconds", options->seconds, "How long; 0: until `weft take stop`")
        ->type_name("S")
        ->check(CLI::NonNegativeNumber);
    command->add_flag("--no-disk-test", options->no_disk_test,
                      "Do not measure first whether the disk keeps up with the cameras");
  }
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, action = what.action, &line] {
    line.run = [options, action, &line] {
      const StopOnSignal signals;
      const absl::StatusOr<std::unique_ptr<RegistrationClient>> connection =
          RegistrationClient::Connect(options->server);
      if (!connection.ok()) return connection.status();
      TakeClient client(**connection);
      return action({client, *options, line.quiet, signals.token()});
    };
  });
}

}  // namespace

void AddRemoteTakeCommands(CLI::App& take, CommandLine& line) {
  const RemoteTakeCommand commands[] = {
      {"start",
       "Have a daemon record the cameras of a session, and print the id of the take. The take goes on when "
       "this "
       "command or the daemon ends",
       "  weft take start --session session.json --server 127.0.0.1:7411\n"
       "  weft take start --session session.json --seconds 60 --server 127.0.0.1:7411",
       RemoteTakeArguments::kSession, StartRemoteTake},
      {"stop", "Close a take that a daemon records, and wait until it is closed",
       "  weft take stop 20260131-104500-1a2b3c4d --server 127.0.0.1:7411", RemoteTakeArguments::kTake,
       StopRemoteTake},
      {"watch",
       "Follow a take that a daemon records until it has ended. Stopping the command leaves the take alone. "
       "Exit "
       "status 1 when it failed",
       "  weft take watch 20260131-104500-1a2b3c4d --server 127.0.0.1:7411", RemoteTakeArguments::kTake,
       WatchRemoteTake},
      {"list", "List the takes that a daemon records or recorded, the newest first",
       "  weft take list --server 127.0.0.1:7411", RemoteTakeArguments::kLimit, ListRemoteTakes}};
  for (const RemoteTakeCommand& command : commands) AddRemoteTakeCommand(take, line, command);
}

}  // namespace weft
