// What every command of `weft` shares: how it is run, what its exit status means, how it prints.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <string>

#include "absl/status/status.h"

namespace weft {

// 0 done, 1 failed, 2 bad arguments or input.
enum ExitStatus : int { kExitDone = 0, kExitFailed = 1, kExitBadInput = 2 };

// The one place that maps an outcome to the exit status: InvalidArgument, NotFound, OutOfRange,
// AlreadyExists, PermissionDenied and FailedPrecondition (inputs that do not fit each other) are bad input,
// every other error is a failure.
int ExitStatusOf(const absl::Status& status);

// The parsed command line. A command's Add function declares its options and, in the subcommand's callback,
// sets `run`; main runs it after everything is parsed.
struct CommandLine {
  bool quiet = false;  // no progress, no notes
  std::function<absl::Status()> run;
};

// A subcommand with the house's manners: shows defaults, its examples below the options, --help.
CLI::App* AddCommand(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& examples);

// "weft: error: ..." on stderr, with a category where the message alone may not say enough.
void PrintError(const absl::Status& status);
// "weft: warning: ..." on stderr.
void PrintWarning(const std::string& message);

}  // namespace weft
