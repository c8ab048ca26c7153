// Commands that ask a daemon for one thing each.
#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <stop_token>

#include "base/status_macros.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/command_line.h"
#include "services/tools/client/registration_client.h"

namespace weft {

template <typename Client, typename Options>
struct RemoteContext {
  Client& client;
  const Options& options;
  bool quiet;
  std::stop_token stop;  // Ctrl-C
};

// `Options` has `server` and `json`.
template <typename Client, typename Options>
struct RemoteCommand {
  const char* name;
  const char* description;
  const char* example;
  void (*add_arguments)(CLI::App& command, Options& options);  // besides --server and --json
  absl::Status (*action)(const RemoteContext<Client, Options>& context);
};

// Each has options of its own: WEFT_SERVER sets those of all.
template <typename Client, typename Options>
void AddRemoteCommand(CLI::App& group, CommandLine& line, const RemoteCommand<Client, Options>& what) {
  CLI::App* command = AddCommand(group, what.name, what.description, what.example);
  auto options = std::make_shared<Options>();
  AddServerOption(*command, options->server, "HOST:PORT of the daemon")->required();
  what.add_arguments(*command, *options);
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, action = what.action, &line] {
    line.run = [options, action, &line]() -> absl::Status {
      const StopOnSignal signals;
      WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(options->server));
      Client client(*connection);
      return action({client, *options, line.quiet, signals.token()});
    };
  });
}

}  // namespace weft
