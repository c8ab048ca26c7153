// weft daemon: what an administrator does with a daemon that runs.
#include <cstdio>
#include <memory>

#include "absl/strings/str_cat.h"
#include "services/cli/commands.h"
#include "services/client/server_client.h"

namespace weft {
namespace {

struct DrainCommandOptions {
  std::string server;
  bool finish_jobs = false;
};

absl::Status RunDrain(const DrainCommandOptions& options, bool quiet) {
  const auto connection = RegistrationClient::Connect(options.server);
  if (!connection.ok()) return connection.status();
  v1::DrainRequest request;
  request.set_finish_jobs(options.finish_jobs);
  std::string told;
  const absl::Status status =
      ServerClient(**connection).DrainUntilItStops(request, [&](const auto& progress) {
        std::string line = absl::StrCat(progress.frames_running(), " frames run, ",
                                        progress.jobs_unfinished(), " jobs have not ended");
        if (quiet || line == told) return;
        std::fprintf(stderr, "draining: %s\n", line.c_str());
        told = std::move(line);
      });
  if (!status.ok()) return status;
  std::printf("the daemon at %s has stopped; its next start goes on\n", options.server.c_str());
  return absl::OkStatus();
}

}  // namespace

void AddDaemonCommand(CLI::App& app, CommandLine& line) {
  CLI::App* group = AddCommand(app, "daemon", "Administer a daemon that runs.", "");
  group->require_subcommand(1);
  const auto options = std::make_shared<DrainCommandOptions>();
  CLI::App* drain = AddCommand(
      *group, "drain",
      "Stop a daemon without loss of work, for example for an update. It refuses new jobs, takes and "
      "operations, "
      "lets the frames end that workers are at, and stops. Takes that are recorded go on without it.",
      "  weft daemon drain --server unix:/var/lib/weft/weftd.sock\n"
      "  weft daemon drain --jobs --server 127.0.0.1:7411");
  AddServerOption(*drain, options->server, "unix:PATH or HOST:PORT of the daemon")->required();
  drain->add_flag("--jobs", options->finish_jobs, "Let all jobs end first");
  drain->callback(
      [options, &line] { line.run = [options, &line] { return RunDrain(*options, line.quiet); }; });
}

}  // namespace weft
