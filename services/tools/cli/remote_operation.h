// Commands that a daemon can run instead of this machine.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>

#include "services/tools/cli/command_line.h"

namespace weft {

// Gives the command --server: without it `here` is run; with it the daemon runs the same command line
// (services/work/spec/operation_kinds.cpp), its inputs being files of the daemon's machine, take:ID or
// job:ID. What it writes is fetched to --out. Call it once all options are declared. Here it is confined to
// the files that `confined` gives, if any.
void RunHereOrAtDaemon(CLI::App& command, CommandLine& line, std::function<absl::Status()> here,
                       std::function<std::optional<ConfinedFiles>()> confined = {});

}  // namespace weft
