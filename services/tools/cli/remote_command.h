// Commands that ask a daemon for one thing each.
#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <optional>
#include <stop_token>
#include <type_traits>

#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/command_line.h"
#include "services/tools/cli/json_output.h"
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
  bool has_json = true;
  bool ends_by_signal = false;                              // at once; otherwise Ctrl-C is a request to stop
  absl::Status (*check)(const Options& options) = nullptr;  // before it connects
};

// What a daemon answered, as JSON or by `print`, which --quiet leaves out.
template <typename Answer, typename Context, typename Print>
absl::Status PrintAnswer(const absl::StatusOr<Answer>& answer, const Context& context, Print print) {
  if (!answer.ok()) return answer.status();
  if (context.options.json) return PrintJsonMessage(*answer);
  if (!context.quiet) print(*answer);
  return absl::OkStatus();
}

// --limit of a list.
template <typename Options>
void AddListLimit(CLI::App& command, Options& options) {
  AddOption(command, "--limit N", options.limit, "At most this many", CLI::Range(1, 1000));
}

// Each has options of its own: WEFT_SERVER sets those of all.
template <typename Client, typename Options>
void AddRemoteCommand(CLI::App& group, CommandLine& line, const RemoteCommand<Client, Options>& what) {
  CLI::App* command = AddCommand(group, what.name, what.description, what.example);
  auto options = std::make_shared<Options>();
  AddServerOption(*command, options->server, "HOST:PORT of the daemon")->required();
  what.add_arguments(*command, *options);
  if (what.has_json) command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, what, &line] {
    line.run = [options, what, &line]() -> absl::Status {
      if (what.check != nullptr) WEFT_RETURN_IF_ERROR(what.check(*options));
      std::optional<StopOnSignal> signals;
      if (!what.ends_by_signal) signals.emplace();
      const std::stop_token stop = signals ? signals->token() : std::stop_token();
      WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(options->server));
      if constexpr (std::is_same_v<Client, RegistrationClient>) {
        return what.action({*connection, *options, line.quiet, stop});
      } else {
        Client client(*connection);
        return what.action({client, *options, line.quiet, stop});
      }
    };
  });
}

}  // namespace weft
