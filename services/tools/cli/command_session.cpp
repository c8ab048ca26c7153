// weft session: who works with which cameras of a daemon.
#include <pwd.h>
#include <unistd.h>

#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/timed_id.h"
#include "services/formats/files/enum_words.h"
#include "services/ground/process/exit_status.h"
#include "services/studio/recording/session_file.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/remote_command.h"
#include "services/tools/cli/upload_inputs.h"
#include "services/tools/client/session_client.h"

namespace weft {
namespace {

struct SessionCommandOptions {
  std::string server;
  std::string session;
  v1::OpenSessionRequest open;  // its texts
  std::string lease;
  double lease_s = 60;
  bool take_over = false;
  bool detach = false;
  int limit = 20;
  bool json = false;
};

using SessionContext = RemoteContext<SessionClient, SessionCommandOptions>;

// "anna at stage2".
std::string ThisUser() {
  const passwd* user = getpwuid(getuid());
  char host[256] = {};
  if (gethostname(host, sizeof(host) - 1) != 0) host[0] = '\0';
  return absl::StrCat(user == nullptr ? "somebody" : user->pw_name, " at ", host);
}

const char* SessionStateWord(v1::CaptureSessionState state) { return EnumWord(state, "closed"); }

absl::Status OpenRemoteSession(const SessionContext& context) {
  const SessionCommandOptions& options = context.options;
  v1::OpenSessionRequest request = options.open;
  WEFT_ASSIGN_OR_RETURN(*request.mutable_cameras(), ReadSession(options.session));
  for (std::string* input : {request.mutable_rig(), request.mutable_board(), request.mutable_garment()})
    *input = NameAtDaemon(*input);
  if (request.owner().empty()) request.set_owner(ThisUser());
  request.set_lease_s(options.lease_s);
  request.set_take_over(options.take_over);
  request.set_idempotency_key(NewTimedId());
  WEFT_ASSIGN_OR_RETURN(const v1::CaptureSession session, context.client.Open(request));
  if (!options.json) {
    std::printf("%s\n", session.lease().c_str());
  } else if (absl::Status status = PrintJsonMessage(session); !status.ok()) {
    return status;
  }
  std::fflush(stdout);
  if (options.detach) return absl::OkStatus();
  if (!context.quiet) {
    std::fprintf(stderr,
                 "the session is open until this command is stopped (Ctrl-C); takes are started with\n"
                 "  weft take start --lease %s --server %s\n",
                 session.lease().c_str(), options.server.c_str());
  }
  WEFT_RETURN_IF_ERROR(context.client.Hold(session, session.lease(), context.stop));
  return context.client.Close(session.lease()).status();
}

absl::Status PrintSession(const absl::StatusOr<v1::CaptureSession>& session, const SessionContext& context) {
  return PrintAnswer(session, context, [](const v1::CaptureSession& one) {
    std::printf("%s  %s, of %s\n", one.id().c_str(), SessionStateWord(one.state()), one.owner().c_str());
  });
}

absl::Status RenewRemoteSession(const SessionContext& context) {
  return PrintSession(context.client.Renew(context.options.lease), context);
}

absl::Status CloseRemoteSession(const SessionContext& context) {
  return PrintSession(context.client.Close(context.options.lease), context);
}

absl::Status ListRemoteSessions(const SessionContext& context) {
  WEFT_ASSIGN_OR_RETURN(const v1::ListSessionsResponse list, context.client.List(context.options.limit));
  if (context.options.json) return PrintJsonMessage(list);
  for (const std::string& warning : list.warnings()) PrintWarning(warning);
  if (list.sessions().empty()) std::printf("no sessions at %s\n", context.options.server.c_str());
  for (const v1::CaptureSession& session : list.sessions()) {
    std::string line =
        absl::StrFormat("%s  %-10s  %d cameras  %s", session.id(), SessionStateWord(session.state()),
                        session.cameras().cameras_size(), session.owner());
    if (session.state() == v1::CAPTURE_SESSION_STATE_OPEN) {
      absl::StrAppendFormat(&line, ", its lease lasts %.0f s more", session.remaining_s());
    }
    if (!session.ended_by().empty()) absl::StrAppend(&line, ", by ", session.ended_by());
    std::printf("%s\n", line.c_str());
  }
  return absl::OkStatus();
}

void AddOpenArguments(CLI::App& command, SessionCommandOptions& options) {
  AddRequired(command, "SESSION FILE", options.session, "session.json with cameras, rate and tolerance");
  AddOption(command, "--rig FILE", *options.open.mutable_rig(),
            "Rig of the jobs for its takes, on the daemon's machine");
  AddOption(command, "--board FILE", *options.open.mutable_board(), "Board of the jobs for its takes");
  AddOption(command, "--template DIR", *options.open.mutable_garment(), "Template of the jobs for its takes");
  AddOption(command, "--owner NAME", *options.open.mutable_owner(),
            "Who you are, for others to see; user and machine otherwise");
  AddOption(command, "--lease-s S", options.lease_s, "How long the session lasts when nobody renews it",
            CLI::Range(5.0, 604800.0));
  command.add_flag("--take-over", options.take_over,
                   "End the sessions that have any of these cameras; takes that run go on");
  command.add_flag("--detach", options.detach,
                   "Do not stay to renew the lease; `weft session renew` does it");
}

void AddLeaseArgument(CLI::App& command, SessionCommandOptions& options) {
  command.add_option("LEASE", options.lease, "What `weft session open` printed")
      ->envname("WEFT_LEASE")
      ->required();
}

}  // namespace

void AddSessionCommand(CLI::App& app, CommandLine& line) {
  CLI::App* group = AddGroup(app, "session", "Sessions of a daemon: who works with which cameras.");
  const RemoteCommand<SessionClient, SessionCommandOptions> commands[] = {
      {"open",
       "Reserve the cameras of a session.json, and print the lease that starts takes with them. The session "
       "ends when this command does; one whose owner is gone expires",
       "  weft session open session.json --server 127.0.0.1:7411\n"
       "  weft session open session.json --rig rig.json --board board.json --template shirt --detach "
       "--lease-s 3600 --server 127.0.0.1:7411",
       AddOpenArguments, OpenRemoteSession},
      {"renew", "Have the lease of a session last its whole time again",
       "  weft session renew $LEASE --server 127.0.0.1:7411", AddLeaseArgument, RenewRemoteSession},
      {"close", "End a session. A take that runs goes on until it is stopped",
       "  weft session close $LEASE --server 127.0.0.1:7411", AddLeaseArgument, CloseRemoteSession},
      {"list", "List the sessions of a daemon, the newest first",
       "  weft session list --server 127.0.0.1:7411", AddListLimit, ListRemoteSessions}};
  for (const auto& command : commands) AddRemoteCommand(*group, line, command);
}

}  // namespace weft
