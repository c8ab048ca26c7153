// Options of commands that look at an installation.
#pragma once

#include <CLI/CLI.hpp>

#include "services/tools/installation/installation_check.h"

namespace weft {

// --config and --server.
void AddInstallationOptions(CLI::App& command, InstallationOptions& options);

}  // namespace weft
