// What every command of `weft` shares: how it is declared and run.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "absl/status/status.h"
// For every command.
#include "base/status_macros.h"
#include "services/ground/process/command_option.h"
#include "services/tools/cli/confined_run.h"

namespace weft {

// The parsed command line. A command's Add function declares its options and, in the subcommand's callback,
// sets `run`; main runs it after everything is parsed.
struct CommandLine {
  bool quiet = false;            // no progress, no notes
  bool writes_remotely = false;  // --out is a path of the daemon's machine
  std::function<absl::Status()> run;
  std::optional<ConfinedFiles> confined;  // `run` is confined to these; none: it is not
};

// "Value -2 not in range 0 - 1797...": the bound of 309 digits means that there is none.
std::string WithoutHugeNumbers(const std::string& parse_error);

// NaN and infinity where the option takes a number.
absl::Status CheckFinite(const CLI::App& command);

// InvalidArgument: --out "". Where the folder in which it is to be made is missing: NotFound for files, and
// for takes, boards, templates, rigs and data sets; else a warning, since the command makes it.
absl::Status CheckOut(const CLI::App& command, bool is_quiet);

// A subcommand with Weft's conventions: --help shows defaults, and examples below the options.
CLI::App* AddCommand(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& examples);
// One that has subcommands, of which one must be named.
CLI::App* AddGroup(CLI::App& app, const std::string& name, const std::string& description,
                   const std::string& examples = "");

// The command runs `run` with what was parsed, and whether --quiet was given where it asks for that.
template <typename Options, typename Run>
void RunWith(CLI::App& command, CommandLine& line, const std::shared_ptr<Options>& options, Run run) {
  command.callback([&line, options, run] {
    line.run = [&line, options, run]() -> absl::Status {
      if constexpr (std::is_invocable_v<Run, Options&, bool>) {
        return run(*options, line.quiet);
      } else {
        return run(*options);
      }
    };
  });
}

template <typename Options>
struct CommandWithOptions {
  CLI::App* command;
  std::shared_ptr<Options> options;  // places for what is parsed
};
// Both in one.
template <typename Options, typename Run>
CommandWithOptions<Options> AddCommand(CLI::App& app, CommandLine& line, Run run, const std::string& name,
                                       const std::string& description, const std::string& examples) {
  CommandWithOptions<Options> made{AddCommand(app, name, description, examples), std::make_shared<Options>()};
  RunWith(*made.command, line, made.options, run);
  return made;
}

// Of a value that is one of `names`. Refuses others, with the name that is nearest.
CLI::Validator OneOf(std::vector<std::string> names);

// A unit that LengthUnitNamed knows; its names are listed.
CLI::Validator OneLengthUnit();

// --server, by WEFT_SERVER where it is not given.
CLI::Option* AddServerOption(CLI::App& command, std::string& server, const std::string& description);

}  // namespace weft
