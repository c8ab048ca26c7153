// What shells complete after `weft`: commands, options and the values of options, all taken from the program
// itself.
#pragma once

#include <CLI/CLI.hpp>

#include <string>

#include "services/tools/cli/command_line.h"

namespace weft {

// Scripts that define and register the completion of `app`. Words that are neither a command nor an option
// nor one of an option's values are completed as file names.
std::string BashCompletion(const CLI::App& app);
std::string ZshCompletion(const CLI::App& app);

// The command that prints them.
void AddCompletionCommand(CLI::App& app, CommandLine& line);

}  // namespace weft
