// What every command of `weft` shares: how it is declared and run.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <string>

#include "absl/status/status.h"

namespace weft {

// The parsed command line. A command's Add function declares its options and, in the subcommand's callback,
// sets `run`; main runs it after everything is parsed.
struct CommandLine {
  bool quiet = false;  // no progress, no notes
  std::function<absl::Status()> run;
};

// A subcommand with Weft's conventions: --help shows defaults, and examples below the options.
CLI::App* AddCommand(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& examples);

}  // namespace weft
